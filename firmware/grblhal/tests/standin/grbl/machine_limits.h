/* A stand-in for the interface of grblHAL: see hal.h. SPDX-License-Identifier: MIT */
#include "hal.h"
