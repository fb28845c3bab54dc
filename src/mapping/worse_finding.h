#pragma once

namespace mono_pose_tracker {

// Of two that may speak against a map: what is significant is worse than what may be chance, however much
// that is; otherwise the one of which there is more.
template <typename Finding, typename Amount>
bool is_worse_finding(const Finding& a, const Finding& b, const Amount& amount_of) {
  return a.is_significant() != b.is_significant() ? a.is_significant() : amount_of(a) > amount_of(b);
}

}  // namespace mono_pose_tracker
