// Vectors, twists and wrenches as values, under their names alone in this room.
#pragma once

#include "engine/model/vectors.hpp"

namespace ksl::loops {

using vectors::at_frame;
using vectors::cross;
using vectors::difference;
using vectors::dot;
using vectors::length;
using vectors::magnitude;
using vectors::product;
using vectors::scaled;
using vectors::screw_of;
using vectors::sum;
using vectors::turned;
using vectors::turned_back;
using vectors::work;

} // namespace ksl::loops
