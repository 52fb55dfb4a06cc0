C     As a laboratory writes it: loads a program of motion into BUSHD-2
C     at station 5, starts it, is called when it has ended, and reads
C     back. Stops with a number that is not 0 where something is wrong.
      PROGRAM MOTION
      INTEGER*4 NSTEPS, NCODES, NBYTES
      PARAMETER (NCODES = 238, NBYTES = 2 + NCODES)
      INTEGER*4 MEMORY, ADDRES, CONTRL, REQUES
      INTEGER*4 DATA, K, Q, I, CB(4), INTA(2)
      INTEGER*2 BYTES(NBYTES), BACK(NBYTES)
      INTEGER*4 LAM, SERVED
      COMMON /SERVE/ LAM, SERVED
      VOLATILE SERVED
      EXTERNAL ONLAM

      CALL CCINIT(1)
      CALL CDREG(MEMORY, 1, 1, 5, 0)
      CALL CDREG(ADDRES, 1, 1, 5, 1)
      CALL CDREG(CONTRL, 1, 1, 5, 2)
      CALL CDREG(REQUES, 1, 1, 5, 3)
      CALL CCCZ(MEMORY)
      CALL CTSTAT(K)
      IF (K .NE. 0) STOP 1

C     The number of steps, the low byte first, and codes that fall: the motor accelerates.
      NSTEPS = 205
      BYTES(1) = INT(MOD(NSTEPS, 256), 2)
      BYTES(2) = INT(NSTEPS / 256, 2)
      DO 10 I = 1, NCODES
        BYTES(2 + I) = INT(251 - I, 2)
   10 CONTINUE
      DATA = 0
      CALL CFSA(16, ADDRES, DATA, Q)
      CB(1) = NBYTES
      CB(3) = 0
      CB(4) = 0
      CALL CSUBC(16, MEMORY, BYTES, CB)
      CALL CTSTAT(K)
      IF (K .NE. 0 .OR. CB(2) .NE. NBYTES) STOP 2

C     Motor 0, to the right; requests of faults and of the end.
      DATA = 96
      CALL CFSA(16, CONTRL, DATA, Q)
      INTA(1) = 0
      INTA(2) = 0
      SERVED = 0
      CALL CDLAM(LAM, 1, 1, 5, 0, INTA)
      CALL CCLNK(LAM, ONLAM)
      CALL CTSTAT(K)
      IF (K .NE. 0) STOP 3
      CALL CFSA(26, MEMORY, DATA, Q)
   20 IF (SERVED .EQ. 0) THEN
        CALL CFSA(0, REQUES, DATA, Q)
        GO TO 20
      END IF
      CALL CCULK(LAM)
      CALL CFSA(0, REQUES, DATA, Q)
      IF (MOD(DATA, 256) .NE. 16) STOP 4

      DATA = 0
      CALL CFSA(16, ADDRES, DATA, Q)
      CALL CSUBC(0, MEMORY, BACK, CB)
      IF (CB(2) .NE. NBYTES) STOP 5
      DO 30 I = 1, NBYTES
        IF (BACK(I) .NE. BYTES(I)) STOP 6
   30 CONTINUE
      END

C     The LAM is raised.
      SUBROUTINE ONLAM
      INTEGER*4 LAM, SERVED
      COMMON /SERVE/ LAM, SERVED
      VOLATILE SERVED
      CALL CCLC(LAM)
      SERVED = 1
      END
