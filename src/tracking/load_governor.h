#pragma once

#include <array>
#include <cstddef>
#include <mutex>

namespace mono_pose_tracker {

struct FramePeriodOptions {
  double pause_s = 2;          // a longer gap is a pause, not a slow camera
  std::size_t least_gaps = 8;  // fewer may be a single burst
};

/// Estimates the period of a live camera from all images, including dropped ones. May be used from any
/// thread. It has no clock; times are passed in.
class FramePeriod {
 public:
  /// stamp_s: the image's own stamp [s]; arrival_s: its arrival [s, monotonic clock].
  void note(double stamp_s, double arrival_s);

  /// Milliseconds; 0 while not yet known. The lower quartile of the stamp intervals, which is the camera's
  /// period even if a busy machine drops images. Larger where images arrive more slowly than their stamps (a
  /// recording played at half its rate). Pauses do not count.
  double milliseconds() const;

  /// Whether an image has arrived after this time.
  bool has_come_after(double arrival_s) const;

 private:
  static constexpr std::size_t kKept = 32;

  mutable std::mutex mutex_;
  std::array<double, kKept> stamp_gaps_s_{}, arrival_gaps_s_{};
  std::size_t noted_ = 0;
  bool has_last_ = false;
  double last_stamp_s_ = 0, last_arrival_s_ = 0;
};

/// Work that is skipped for lack of time; each level includes the previous ones.
enum LoadLevel : int {
  kTimeToSpare = -1,  // an object is searched one octave finer than usual: slow cameras, small images
  kFullWork = 0,
  kLittleDrawn = 1,    // one debug image a second: poses are not affected
  kLessMapped = 2,     // smaller windows, fewer matched keyframes
  kFewerFeatures = 3,  // half of them
  kCoarserOctave = 4,  // the image at half the size; not where the octave was chosen explicitly
};

/// When work is reduced and restored. Shares are of the period, in (0, 1]; counts are in images.
struct LoadGovernorOptions {
  double mean_weight = 0.1;      // of the newest latency
  double too_late = 0.9;         // share: above it, images are dropped as soon as one takes a little longer
  double no_longer_spare = 0.5;  // share: optional work must leave time to other programs
  /// Share at each level, from kFullWork on, below which the next level up would still be in time. Drawing
  /// and mapping, on a thread of its own, take little time from tracking. Twice the features or a finer
  /// octave take nearly twice the time. An octave finer than usual has four times the pixels and up to twice
  /// the features: eight times.
  std::array<double, 5> to_spare = {0.125, 0.75, 0.75, 0.5, 0.5};
  int held_up = 5;       // after a change, that may have waited for an earlier one
  int settling = 15;     // after a change until it shows in the mean
  int least_calm = 90;   // with time to spare, before work is restored: three seconds at 30 Hz
  int most_calm = 1440;  // four doublings: a failing level is tried once in 48 s
};

/// Keeps the latency of live images below their period by reducing work, and restores it when there is time.
/// It has no clock; times are passed in.
class LoadGovernor {
 public:
  /// Called when an image is done, latency_ms after its arrival. period_ms: between two arrivals
  /// (FramePeriod), 0: unknown. overtaken: whether the next one arrived before. A sender that waits for each
  /// answer is never overtaken. Returns the LoadLevel for the next image.
  int observe(double period_ms, double latency_ms, bool overtaken);
  int level() const { return level_; }

 private:
  void do_less();
  void change_level(int level);

  int level_ = kTimeToSpare;    // a map begins in the first images; valid until the period is known
  double mean_ms_ = 0;          // latency, of the last ten images or so
  int since_change_ = 0;        // images
  int since_overtaken_ = 1000;  // images; long ago
  int calm_ = 0;                // consecutive images with time to spare
  int calm_needed_ = LoadGovernorOptions().least_calm;  // before work is restored
  bool went_back_up_ = false;                           // the last change restored work
};

}  // namespace mono_pose_tracker
