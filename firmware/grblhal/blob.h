/* Where the tables come from: an area of flash, or a file.
 *
 * SPDX-License-Identifier: MIT
 * Copyright (c) 2026 The trueaxis maintainers
 */
#ifndef TXA_BLOB_H
#define TXA_BLOB_H

#include <stddef.h>

/* The place of the tables. */
#ifdef TRUEAXIS_FLASH
#define TXA_BLOB_PLACE "flash"
#else
#define TXA_BLOB_PLACE TRUEAXIS_FILE
#endif

/* The bytes, which stay until the next call, and how many they are; null and `why` not. */
const void *txa_blob(size_t *length, const char **why);

#endif
