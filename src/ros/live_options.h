#pragma once

#include <dynamic_reconfigure/Config.h>
#include <dynamic_reconfigure/ConfigDescription.h>
#include <ros/node_handle.h>

#include <cstdint>
#include <string>
#include <vector>

#include "mono_pose_tracker/tracking/options_table.h"

namespace mono_pose_tracker {

/// The options that may change at run time, in the form that dynamic_reconfigure::Server expects. Names and
/// ranges are taken from option_table; a .cfg file would be a second list and cannot hold names such as
/// sift/max_features.
class LiveOptions {
 public:
  TrackerOptions tracker;       // of which only the changeable options are offered
  double publish_period = 0.5;  // s

  /// The changeable options with their ranges; they point into this object.
  std::vector<OptionEntry> entries();

  /// "key: value, ..." of the changed options; empty: none changed.
  std::string changes_since(LiveOptions before) const;

  // The names that dynamic_reconfigure::Server calls.
  static LiveOptions __getMin__();
  static LiveOptions __getMax__();
  static LiveOptions __getDefault__() { return {}; }
  static dynamic_reconfigure::ConfigDescription __getDescriptionMessage__();
  void __fromServer__(const ros::NodeHandle& handle);
  void __toServer__(const ros::NodeHandle& handle) const;
  void __fromMessage__(const dynamic_reconfigure::Config& message);
  void __toMessage__(dynamic_reconfigure::Config& message) const;
  void __clamp__();
  std::uint32_t __level__(const LiveOptions&) const { return 0; }
};

}  // namespace mono_pose_tracker
