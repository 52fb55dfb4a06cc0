// For LD_PRELOAD: writes down, in the file that $BUSHD_BLOCKING_CALLS names, each call of a
// program's first thread that may wait for a disk, a terminal, a driver or another program, from
// its first epoll_wait on. With $BUSHD_FSYNC_MS a disk takes that long, whoever asks it.
#define _GNU_SOURCE
#include <dirent.h>
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <grp.h>
#include <poll.h>
#include <pwd.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <termios.h>
#include <time.h>
#include <unistd.h>

static bool looping;
static int report = -1;

// The function that would have been called.
#define NEXT(name)               \
  static __typeof__(&name) next; \
  if (next == NULL) next = (__typeof__(&name))dlsym(RTLD_NEXT, #name)

static bool in_loop(void) {
  return looping && syscall(SYS_gettid) == syscall(SYS_getpid);
}

static void note(const char* call, const char* what) {
  if (!in_loop()) return;
  char line[512];
  const int size = snprintf(line, sizeof line, "%s %s\n", call, what == NULL ? "" : what);
  if (report < 0) {
    const char* path = getenv("BUSHD_BLOCKING_CALLS");
    if (path == NULL) return;
    report =
        (int)syscall(SYS_openat, AT_FDCWD, path, O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0600);
  }
  if (size > 0)
    syscall(SYS_write, report, line, (size_t)size < sizeof line ? (size_t)size : sizeof line);
}

static void note_fd(const char* call, int fd) {
  char link[64];
  char path[256] = "";
  snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
  const long n = syscall(SYS_readlinkat, AT_FDCWD, link, path, sizeof path - 1);
  if (n > 0) path[n] = 0;
  note(call, path);
}

static mode_t kind_of(int fd) {
  struct stat status;
  return syscall(SYS_newfstatat, fd, "", &status, AT_EMPTY_PATH) == 0 ? (status.st_mode & S_IFMT)
                                                                      : 0;
}

static bool waits(int fd) {
  return (syscall(SYS_fcntl, fd, F_GETFL) & O_NONBLOCK) == 0;
}

static bool ready(int fd, short events) {
  struct pollfd asked = {fd, events, 0};
  const struct timespec now = {0, 0};
  return syscall(SYS_ppoll, &asked, 1, &now, NULL, 0) > 0;
}

// A datagram of the network is given to the kernel or dropped by it: there is nobody to wait for.
static bool is_datagram_of_network(int fd) {
  int domain = 0;
  int type = 0;
  socklen_t size = sizeof domain;
  getsockopt(fd, SOL_SOCKET, SO_DOMAIN, &domain, &size);
  size = sizeof type;
  getsockopt(fd, SOL_SOCKET, SO_TYPE, &type, &size);
  return domain == AF_INET && type == SOCK_DGRAM;
}

static void note_write(const char* call, int fd) {
  const mode_t kind = kind_of(fd);
  // What is no file at all is an eventfd: written in vain it would be one that nobody has read for
  // 2^64 times.
  if (kind == S_IFREG || (kind != 0 && waits(fd))) note_fd(call, fd);
}

static void note_read(const char* call, int fd) {
  if (kind_of(fd) == S_IFREG || (waits(fd) && !ready(fd, POLLIN))) note_fd(call, fd);
}

static void note_send(const char* call, int fd, int flags) {
  if ((flags & MSG_DONTWAIT) == 0 && waits(fd) && !is_datagram_of_network(fd)) note_fd(call, fd);
}

int epoll_wait(int fd, struct epoll_event* events, int most, int timeout) {
  NEXT(epoll_wait);
  looping = true;
  return next(fd, events, most, timeout);
}

int epoll_pwait2(int fd, struct epoll_event* events, int most, const struct timespec* timeout,
                 const sigset_t* mask) {
  NEXT(epoll_pwait2);
  looping = true;
  return next(fd, events, most, timeout, mask);
}

// --- Paths

#define OPEN(name)                                                                   \
  int name(const char* path, int flags, ...) {                                       \
    NEXT(name);                                                                      \
    va_list rest;                                                                    \
    va_start(rest, flags);                                                           \
    const int mode = (flags & (O_CREAT | __O_TMPFILE)) != 0 ? va_arg(rest, int) : 0; \
    va_end(rest);                                                                    \
    note(#name, path);                                                               \
    return next(path, flags, mode);                                                  \
  }
OPEN(open)
OPEN(open64)

#define OPENAT(name)                                                                 \
  int name(int folder, const char* path, int flags, ...) {                           \
    NEXT(name);                                                                      \
    va_list rest;                                                                    \
    va_start(rest, flags);                                                           \
    const int mode = (flags & (O_CREAT | __O_TMPFILE)) != 0 ? va_arg(rest, int) : 0; \
    va_end(rest);                                                                    \
    note(#name, path);                                                               \
    return next(folder, path, flags, mode);                                          \
  }
OPENAT(openat)
OPENAT(openat64)

#define OF_PATH(type, name, parameters, arguments) \
  type name parameters {                           \
    NEXT(name);                                    \
    note(#name, path);                             \
    return next arguments;                         \
  }
OF_PATH(FILE*, fopen, (const char* path, const char* mode), (path, mode))
OF_PATH(FILE*, fopen64, (const char* path, const char* mode), (path, mode))
OF_PATH(DIR*, opendir, (const char* path), (path))
OF_PATH(int, stat, (const char* path, struct stat* status), (path, status))
OF_PATH(int, stat64, (const char* path, struct stat64* status), (path, status))
OF_PATH(int, lstat, (const char* path, struct stat* status), (path, status))
OF_PATH(int, lstat64, (const char* path, struct stat64* status), (path, status))
OF_PATH(int, access, (const char* path, int mode), (path, mode))
OF_PATH(int, rename, (const char* path, const char* to), (path, to))
OF_PATH(int, unlink, (const char* path), (path))
OF_PATH(int, unlinkat, (int folder, const char* path, int flags), (folder, path, flags))
OF_PATH(int, mkdir, (const char* path, mode_t mode), (path, mode))
OF_PATH(int, rmdir, (const char* path), (path))
OF_PATH(int, chmod, (const char* path, mode_t mode), (path, mode))
OF_PATH(int, chown, (const char* path, uid_t user, gid_t group), (path, user, group))
OF_PATH(struct passwd*, getpwnam, (const char* path), (path))
OF_PATH(struct group*, getgrnam, (const char* path), (path))

struct passwd* getpwuid(uid_t user) {
  NEXT(getpwuid);
  note("getpwuid", NULL);
  return next(user);
}

// --- Descriptors

#define OF_FD(type, name, parameters, arguments, before) \
  type name parameters {                                 \
    NEXT(name);                                          \
    before;                                              \
    return next arguments;                               \
  }
OF_FD(ssize_t, write, (int fd, const void* data, size_t size), (fd, data, size),
      note_write("write", fd))
OF_FD(ssize_t, writev, (int fd, const struct iovec* parts, int count), (fd, parts, count),
      note_write("writev", fd))
OF_FD(ssize_t, pwrite, (int fd, const void* data, size_t size, off_t at), (fd, data, size, at),
      note_write("pwrite", fd))
OF_FD(ssize_t, pwrite64, (int fd, const void* data, size_t size, off64_t at), (fd, data, size, at),
      note_write("pwrite64", fd))
OF_FD(ssize_t, read, (int fd, void* data, size_t size), (fd, data, size), note_read("read", fd))
OF_FD(ssize_t, send, (int fd, const void* data, size_t size, int flags), (fd, data, size, flags),
      note_send("send", fd, flags))
OF_FD(ssize_t, sendto,
      (int fd, const void* data, size_t size, int flags, __CONST_SOCKADDR_ARG to, socklen_t length),
      (fd, data, size, flags, to, length), note_send("sendto", fd, flags))
OF_FD(ssize_t, sendmsg, (int fd, const struct msghdr* message, int flags), (fd, message, flags),
      note_send("sendmsg", fd, flags))
OF_FD(int, connect, (int fd, __CONST_SOCKADDR_ARG to, socklen_t length), (fd, to, length),
      if (waits(fd)) note_fd("connect", fd))
OF_FD(int, ftruncate, (int fd, off_t size), (fd, size), note_fd("ftruncate", fd))
OF_FD(int, ftruncate64, (int fd, off64_t size), (fd, size), note_fd("ftruncate64", fd))
OF_FD(int, flock, (int fd, int how), (fd, how), note_fd("flock", fd))
OF_FD(int, tcdrain, (int fd), (fd), note_fd("tcdrain", fd))
OF_FD(int, tcsetattr, (int fd, int when, const struct termios* to), (fd, when, to),
      note_fd("tcsetattr", fd))
// It may write a file back, and waits for what a tty has not sent.
OF_FD(int, close, (int fd), (fd), const mode_t kind = kind_of(fd);
      if (kind == S_IFREG || kind == S_IFCHR) note_fd("close", fd))

static void take_time(void) {
  const char* told = getenv("BUSHD_FSYNC_MS");
  const long ms = told == NULL ? 0 : strtol(told, NULL, 10);
  const struct timespec time = {ms / 1000, ms % 1000 * 1000000};
  if (ms > 0) syscall(SYS_nanosleep, &time, NULL);
}

OF_FD(int, fsync, (int fd), (fd), note_fd("fsync", fd); take_time())
OF_FD(int, fdatasync, (int fd), (fd), note_fd("fdatasync", fd); take_time())

// --- Time

int nanosleep(const struct timespec* time, struct timespec* left) {
  NEXT(nanosleep);
  note("nanosleep", NULL);
  return next(time, left);
}

int clock_nanosleep(clockid_t clock, int flags, const struct timespec* time,
                    struct timespec* left) {
  NEXT(clock_nanosleep);
  note("clock_nanosleep", NULL);
  return next(clock, flags, time, left);
}

int poll(struct pollfd* of, nfds_t count, int timeout) {
  NEXT(poll);
  if (timeout != 0) note("poll", NULL);
  return next(of, count, timeout);
}
