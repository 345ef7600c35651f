#include "check.h"
void events(void) {}
