#pragma once

namespace mono_pose_tracker {

/// Work that is skipped for lack of time; each level includes the previous ones.
enum LoadLevel : int {
  kTimeToSpare = -1,  // an object is searched one octave finer than usual: slow cameras, small images
  kFullWork = 0,
  kLittleDrawn = 1,    // one debug image a second: poses are not affected
  kLessMapped = 2,     // smaller windows, fewer matched keyframes
  kFewerFeatures = 3,  // half of them
  kCoarserOctave = 4,  // the image at half the size; not where the octave was chosen explicitly
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
  int calm_needed_ = 90;        // before work is restored: three seconds at 30 Hz
  bool went_back_up_ = false;   // the last change restored work
};

}  // namespace mono_pose_tracker
