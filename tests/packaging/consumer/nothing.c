/* Linked with whole archives: what these have must link, not only what a program uses. */
int main(void) {
  return 0;
}
