#pragma once

#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include "io/image_source.h"

namespace mono_pose_tracker {

/// Source of a recording whose first images may be inspected beforehand. These images are not read again: the
/// first reader gets them. The source is opened once, and used by one reader after the other where it can be
/// rewound: it knows where the images are that it has read. One thread at a time.
class LookedAtSource {
 public:
  using Open = std::function<std::unique_ptr<ImageSource>()>;

  explicit LookedAtSource(Open open) : state_(std::make_shared<State>(State{std::move(open), {}, {}})) {}

  /// The first readable image. Without any: kEnd, with the error of the first image.
  SourceImage first() const {
    State& state = *state_;
    if (!state.source) state.source = state.open();
    while (state.read.empty() || state.read.back().kind == SourceImage::Kind::kSkipped) {
      state.read.push_back(state.source->next());
    }
    SourceImage image = state.read.back();
    if (image.kind == SourceImage::Kind::kEnd) image.problem = state.read.front().problem;
    return image;
  }

  /// As ImageSource has it.
  double pixel_aspect() const {
    if (!state_->source) state_->source = state_->open();
    return state_->source->pixel_aspect();
  }

  std::unique_ptr<ImageSource> open() const { return std::make_unique<Reader>(state_); }

 private:
  struct State {
    Open open;
    std::unique_ptr<ImageSource> source;
    std::vector<SourceImage> read;  // of the source, so far
  };

  class Reader : public ImageSource {
   public:
    explicit Reader(std::shared_ptr<State> state) : state_(std::move(state)) {}
    ~Reader() override {
      if (source_ && !state_->source && source_->rewind()) state_->source = std::move(source_);
    }
    Reader(const Reader&) = delete;
    Reader& operator=(const Reader&) = delete;

    SourceImage next() override {
      begin();
      if (at_ == read_.size()) return source_->next();
      return std::exchange(read_[at_++], SourceImage());
    }

    bool skip() override {
      begin();
      return at_ < read_.size() ? next().kind != SourceImage::Kind::kEnd : source_->skip();
    }

    // Who only asks for that leaves what was read to others.
    int size() const override {
      if (!source_ && state_->source) return state_->source->size();
      if (!source_) source_ = state_->open();
      return source_->size();
    }

   private:
    void begin() {
      if (source_) return;
      source_ = std::move(state_->source);
      read_ = std::exchange(state_->read, {});
      if (!source_) source_ = state_->open();
    }

    const std::shared_ptr<State> state_;
    mutable std::unique_ptr<ImageSource> source_;
    std::vector<SourceImage> read_;
    std::size_t at_ = 0;
  };

  std::shared_ptr<State> state_;
};

}  // namespace mono_pose_tracker
