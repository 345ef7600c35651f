/* SPDX-License-Identifier: MIT
 *
 * For tests only: rivals.c once more, which the makefile compiles with the options of the component.
 */
#define NAME "rivals_fast"
#include "rivals.c"
