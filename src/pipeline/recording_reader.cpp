#include "recording_reader.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "object_masks.h"
#include "tracking/tracker_impl.h"

namespace mono_pose_tracker {

RecordingReader::RecordingReader(const Recording& recording, const Tracker::Impl& tracker, IsWanted is_wanted,
                                 std::vector<std::string>* problems, const std::set<std::int64_t>* unreadable)
    : recording_(recording),
      tracker_(tracker),
      is_wanted_(std::move(is_wanted)),
      problems_(problems),
      source_(recording.open()),
      reads_again_(unreadable != nullptr),
      unreadable_(unreadable ? *unreadable : std::set<std::int64_t>()),
      items_([this](Item* item) { return read(item); }, [this](Item* item) { prepare(item); },
             std::max(recording.threads - 1, 0)) {}

bool RecordingReader::next() {
  item_ = Item();
  if (!items_.next(&item_)) return false;
  usable_masks_ += item_.is_mask_usable;
  if (problems_) problems_->insert(problems_->end(), item_.problems.begin(), item_.problems.end());
  return item_.source.kind == SourceImage::Kind::kImage;
}

// Called by one thread at a time. The end is an item as well, for the problems before it.
bool RecordingReader::read(Item* item) {
  if (has_ended_) return false;
  while ((recording_.max_frames < 0 || read_ < recording_.max_frames) && !recording_.interrupted()) {
    const std::int64_t place = place_++;
    const bool is_unreadable = unreadable_.count(place) > 0;
    if (is_unreadable || (reads_again_ && !is_wanted_(read_))) {
      item->source = SourceImage();
      const bool is_there = source_->skip();
      if (is_there && is_unreadable) continue;
      if (is_there) item->source.kind = SourceImage::Kind::kImage;
      break;
    }
    item->source = source_->next();
    if (item->source.kind != SourceImage::Kind::kSkipped) break;
    item->problems.push_back(item->source.problem);
    if (reads_again_) {
      ++read_;  // it could be read before
    } else {
      unreadable_.insert(place);
    }
  }
  has_ended_ = item->source.kind != SourceImage::Kind::kImage;
  if (!has_ended_) item->index = read_++;
  return true;
}

void RecordingReader::prepare(Item* item) const {
  if (item->index < 0 || item->source.image.empty()) return;
  const SourceImage& source = item->source;
  if (recording_.masks) {
    std::string problem;
    item->mask = recording_.masks->mask_of(source.mask_name, source.image.size(), &problem);
    if (item->mask.empty()) item->problems.push_back(problem);
    item->is_mask_usable = !item->mask.empty() && cv::countNonZero(item->mask) > 0;
  }
  if (!source.mask.empty()) item->mask = item->mask.empty() ? source.mask : cv::Mat(item->mask & source.mask);
  item->prepared.image = source.image;
  if (!is_wanted_(item->index)) return;
  if (recording_.object_masks) {
    const cv::Mat found = recording_.object_masks->mask(item->index, source.image.size());
    item->mask = item->mask.empty() ? found : cv::Mat(item->mask & found);
  }
  item->prepared =
      tracker_.frame_maker().prepare(source.image, item->mask, recording_.features.get(), item->index);
}

void read_again(const Recording& recording, const RecordingResult& result, const Tracker::Impl& tracker,
                const std::set<std::int64_t>& wanted,
                const std::function<void(const RecordingReader&)>& use) {
  // A folder may have grown meanwhile: images that the first pass did not read are ignored.
  const auto end = wanted.lower_bound(result.frames_total);
  if (end == wanted.begin()) return;
  const std::int64_t last = *std::prev(end);
  RecordingReader reader(
      recording, tracker, [&](std::int64_t index) { return wanted.count(index) > 0; }, nullptr,
      &result.unreadable);
  while (reader.index() < last && reader.next()) {
    if (wanted.count(reader.index()) > 0) use(reader);
  }
}

}  // namespace mono_pose_tracker
