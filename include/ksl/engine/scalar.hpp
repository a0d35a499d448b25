#pragma once
#include "ksl/engine/lanes/scalar.hpp" // where it is now
