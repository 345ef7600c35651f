/* Source of the tables: an area of flash, or a file.
 *
 * SPDX-License-Identifier: MIT
 * Copyright (c) 2026 The trueaxis maintainers
 */
#ifndef TXA_BLOB_H
#define TXA_BLOB_H

#include <stddef.h>

/* The location of the tables. */
#ifdef TRUEAXIS_FLASH
#define TXA_BLOB_PLACE "flash"
#else
#define TXA_BLOB_PLACE TRUEAXIS_FILE
#endif

/* The bytes, which remain valid until the next call, and their number; on failure null, with the reason in `why`. */
const void *txa_blob(size_t *length, const char **why);

#endif
