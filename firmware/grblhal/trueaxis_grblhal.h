/* trueaxis for grblHAL: functions for a driver or another plugin. The manual: docs/src/grblhal.md
 *
 * SPDX-License-Identifier: MIT
 * Copyright (c) 2026 The trueaxis maintainers
 */
#ifndef TRUEAXIS_GRBLHAL_H
#define TRUEAXIS_GRBLHAL_H

#include <stdbool.h>

/* Registers the plugin; call it once, from `driver_init`. `my_plugin_init` does so unless TRUEAXIS_NO_MY_PLUGIN is
 * defined. */
void trueaxis_init(void);

/* Sets the temperature (°C; NAN: the sensor has failed) of the auxiliary input with this name. Returns false if
 * there is no such input. Not from an interrupt. */
bool trueaxis_set_temperature(const char *name, float celsius);

#endif
