#include "check.h"
void transitions(void) {}
