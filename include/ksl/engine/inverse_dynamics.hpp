#pragma once
#include "ksl/engine/algorithms/inverse/inverse_dynamics.hpp" // where it is now
