#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <opencv2/core.hpp>
#include <set>
#include <string>
#include <vector>

#include "common/threads.h"
#include "pipeline/recording.h"

namespace mono_pose_tracker {

// Reads and prepares the images of a recording ahead, on threads - 1 threads.
class RecordingReader {
 public:
  using IsWanted = std::function<bool(std::int64_t)>;  // by index; other images are not prepared

  // problems: receives a line for each unreadable image or mask; may be null. unreadable: those of the first
  // time (RecordingResult) where the recording is read once more; unwanted images are then skipped and have
  // no pixels and no names.
  RecordingReader(const Recording& recording, const Tracker::Impl& tracker, IsWanted is_wanted,
                  std::vector<std::string>* problems, const std::set<std::int64_t>* unreadable = nullptr);

  // Returns false at the end.
  bool next();

  std::int64_t index() const { return item_.index; }
  const SourceImage& image() const { return item_.source; }
  const PreparedImage& prepared() const { return item_.prepared; }
  const cv::Mat& mask() const { return item_.mask; }
  std::int64_t usable_masks() const { return usable_masks_; }
  // Images that could not be read so far, counted with those that could. After the end.
  const std::set<std::int64_t>& unreadable() const { return unreadable_; }

 private:
  // The next image with its mask, or the end.
  struct Item {
    std::int64_t index = -1;  // counts the readable images
    SourceImage source;
    cv::Mat mask;
    bool is_mask_usable = false;
    std::vector<std::string> problems;  // since the previous item
    PreparedImage prepared;
  };

  bool read(Item* item);
  void prepare(Item* item) const;

  const Recording& recording_;
  const Tracker::Impl& tracker_;
  const IsWanted is_wanted_;
  std::vector<std::string>* problems_;
  std::unique_ptr<ImageSource> source_;
  const bool reads_again_;
  std::set<std::int64_t> unreadable_;
  std::int64_t place_ = 0;  // of the next image in the source
  std::int64_t read_ = 0;
  std::int64_t usable_masks_ = 0;
  bool has_ended_ = false;
  Item item_;
  Prefetcher<Item> items_;  // last: its threads use the members above
};

// Reads the wanted images of a result once more, in order.
void read_again(const Recording& recording, const RecordingResult& result, const Tracker::Impl& tracker,
                const std::set<std::int64_t>& wanted, const std::function<void(const RecordingReader&)>& use);

}  // namespace mono_pose_tracker
