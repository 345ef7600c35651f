/* SPDX-License-Identifier: MIT
 *
 * For tests only: rivals.c again, compiled by the makefile with the options of the component.
 */
#define NAME "rivals_fast"
#include "rivals.c"
