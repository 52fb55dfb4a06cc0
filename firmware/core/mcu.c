#include "firmware/core/mcu.h"
