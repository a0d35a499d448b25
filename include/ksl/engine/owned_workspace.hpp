#pragma once
#include "ksl/engine/lanes/owned_workspace.hpp" // where it is now
