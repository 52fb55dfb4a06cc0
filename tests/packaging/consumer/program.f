C     Asks the daemon for one cycle, and prints the status: 9, bushd is
C     not running.
      PROGRAM ASK
      INTEGER*4 EXT, DATA, Q, K
      DATA = 0
      CALL CDREG(EXT, 1, 1, 5, 0)
      CALL CFSA(0, EXT, DATA, Q)
      CALL CTSTAT(K)
      IF (K / 4 .EQ. 9) PRINT '(A)', 'bushd is not running'
      END
