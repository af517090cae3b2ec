#pragma once
/// cpp-httplib as Debian builds it. Its header brings in resolv.h, which makes a macro of a name that Eigen uses.
#include <httplib.h>
#undef _res
