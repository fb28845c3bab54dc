#include "mono_pose_tracker/mapping/background_watch.h"

#include <cstddef>

namespace mono_pose_tracker {

namespace {

// A feature must be seen three times in its place while others move. A map that was right may have gone
// astray; what was seen long ago does not speak for it.
constexpr std::size_t kFewest = 5, kMost = 12;

}  // namespace

void BackgroundWatch::note(const SeenImage& newest, const MatchOptions& matching, bool body_turns) {
  if (!images_.empty()) {
    in_time_.push_back(
        match_descriptors(images_.back().image->set.descriptors, newest.image->set.descriptors, matching));
  }
  images_.push_back(newest);
  if (images_.size() > kMost) {
    images_.erase(images_.begin());
    in_time_.erase(in_time_.begin());
  }
  found_.reset();
  if (images_.size() < kFewest) return;
  const StillBackground background = find_still_background(images_, in_time_, matching, body_turns, 1);
  if (!background.exists) return;
  found_ = std::make_shared<const TurningBody>(TurningBody{newest.image, background.newest});
}

}  // namespace mono_pose_tracker
