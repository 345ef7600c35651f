#include "check.h"
void kinematics_within(void) {}
