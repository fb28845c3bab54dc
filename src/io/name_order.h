#pragma once

#include <string>
#include <vector>

namespace mono_pose_tracker {

// By name, numbers in it by their value: frame_2 before frame_10. What stands behind a point after a digit is
// a fraction (1403636579.81 is later than 1403636579.7635), and goes as text.
std::vector<std::string> in_order_of_names(std::vector<std::string> names);

}  // namespace mono_pose_tracker
