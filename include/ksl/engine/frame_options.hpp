// KSL: how a motion of a frame is expressed.
#pragma once

namespace ksl {

enum class expressed_in : int { frame, world }; ///< the frame of the link itself, or that of the world

/// The axes and the origin that a motion is expressed in, and the order of its six numbers.
struct frame_options {
  expressed_in axes = expressed_in::frame;
  expressed_in at = expressed_in::frame;
  bool angular_first = false;
};

} // namespace ksl
