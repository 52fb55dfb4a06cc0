// What a node of one kind makes of its contacts: four_keys.c or switch_and_key.c.
#ifndef BUSHD_FIRMWARE_PORTS_KEYPAD_KEYS_H
#define BUSHD_FIRMWARE_PORTS_KEYPAD_KEYS_H

#include <stdbool.h>
#include <stdint.h>

// Contacts at PC0 .. PC3, to ground.
#define CONTACTS 0x0Fu

typedef enum key_byte { FORWARD = 0x00, STOP = 0xFD, SLOWER = 0xFE, REVERSE = 0xFF } key_byte;

enum { REPEAT_MS = 100 };  // of a direction, for a motor that is to stop without it

typedef struct keys {
  uint8_t counts;     // contacts that have been taken
  uint8_t repeat_ms;  // since a direction was sent, up to REPEAT_MS
  uint16_t held_ms;   // the speed key
  bool begun;         // there has been a change since power came
  bool moves;         // the motor has been told a direction
} keys;

typedef struct wish {
  key_byte byte;
  bool is_new;  // not the repetition of a direction
} wish;

// Every ms, with the contacts that are closed and have been read alike for long enough. True:
// `byte` is to be sent, and is, unless the line is busy: then nothing was taken, and the next call
// says it again.
bool keys_follow(keys* k, uint8_t closed, bool line_is_free, wish* w);

#endif
