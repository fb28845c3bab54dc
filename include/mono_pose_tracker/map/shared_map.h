#pragma once

#include <algorithm>
#include <array>
#include <bitset>
#include <cstddef>
#include <iterator>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <tuple>
#include <utility>
#include <vector>

namespace mono_pose_tracker {

/// Values by ids >= 0 with the read interface of a std::map. Copies share their chunks: a copy costs one
/// pointer per chunk of kChunk ids, a change afterwards copies one chunk. Ids in use should be close
/// together.
template <typename Value, int kChunk = 1>
class SharedMap {
  struct Chunk {
    std::array<Value, kChunk> values;
    std::bitset<kChunk> there;
  };
  using Chunks = std::vector<std::pair<int, std::shared_ptr<const Chunk>>>;  // by id / kChunk

 public:
  struct Entry {
    int first;
    const Value& second;
  };

  /// Bidirectional; *it is an Entry. Invalid after a change.
  class Iterator {
   public:
    using iterator_category = std::bidirectional_iterator_tag;
    using value_type = Entry;
    using difference_type = std::ptrdiff_t;
    using reference = Entry;
    struct pointer {
      Entry entry;
      const Entry* operator->() const { return &entry; }
    };

    Entry operator*() const {
      const auto& [number, chunk] = (*chunks_)[chunk_];
      return {number * kChunk + slot_, chunk->values[slot_]};
    }
    pointer operator->() const { return {**this}; }
    Iterator& operator++() {
      ++slot_;
      return *this = on_from(chunks_, chunk_, slot_);
    }
    Iterator& operator--() {
      do {
        if (slot_ == 0) --chunk_, slot_ = kChunk;
        --slot_;
      } while (!(*chunks_)[chunk_].second->there[slot_]);
      return *this;
    }
    bool operator==(const Iterator& other) const { return chunk_ == other.chunk_ && slot_ == other.slot_; }
    bool operator!=(const Iterator& other) const { return !(*this == other); }

   private:
    friend class SharedMap;
    Iterator(const Chunks* chunks, std::size_t chunk, int slot)
        : chunks_(chunks), chunk_(chunk), slot_(slot) {}

    // The first entry at or after this position.
    static Iterator on_from(const Chunks* chunks, std::size_t chunk, int slot) {
      for (; chunk < chunks->size(); ++chunk, slot = 0) {
        for (; slot < kChunk; ++slot) {
          if ((*chunks)[chunk].second->there[slot]) return {chunks, chunk, slot};
        }
      }
      return {chunks, chunk, 0};
    }

    const Chunks* chunks_;
    std::size_t chunk_;
    int slot_;
  };
  using const_iterator = Iterator;

  bool empty() const { return size_ == 0; }
  std::size_t size() const { return size_; }
  Iterator begin() const { return Iterator::on_from(&chunks_, 0, 0); }
  Iterator end() const { return {&chunks_, chunks_.size(), 0}; }
  auto rbegin() const { return std::make_reverse_iterator(end()); }
  auto rend() const { return std::make_reverse_iterator(begin()); }

  Iterator find(int id) const {
    const std::size_t at = chunk_of(id);
    if (id < 0 || !is_chunk(at, id) || !chunks_[at].second->there[id % kChunk]) return end();
    return {&chunks_, at, id % kChunk};
  }
  Iterator upper_bound(int id) const {
    if (id < 0) return begin();
    const std::size_t at = chunk_of(id);
    return Iterator::on_from(&chunks_, at, is_chunk(at, id) ? id % kChunk + 1 : 0);
  }
  std::size_t count(int id) const { return find(id) != end(); }
  const Value& at(int id) const {
    const Iterator found = find(id);
    if (found == end()) throw std::out_of_range("there is no value of this id");
    return (*found).second;
  }

  using Changes = std::map<int, std::optional<Value>>;
  /// Sets values, or removes those that are none; each chunk is copied once. Removed values are freed with
  /// the last copy of their chunk.
  void change(Changes changes) {
    std::shared_ptr<Chunk> chunk;
    std::size_t at = 0;
    bool may_be_empty = false;
    for (auto& [id, value] : changes) {
      if (!chunk || chunks_[at].first != id / kChunk) std::tie(at, chunk) = copy_chunk(id);
      const int slot = id % kChunk;
      size_ += static_cast<int>(value.has_value()) - static_cast<int>(chunk->there[slot]);
      chunk->there[slot] = value.has_value();
      may_be_empty |= !value;
      if (value) chunk->values[slot] = std::move(*value);
    }
    if (!may_be_empty) return;
    const auto is_empty = [](const auto& numbered) { return numbered.second->there.none(); };
    chunks_.erase(std::remove_if(chunks_.begin(), chunks_.end(), is_empty), chunks_.end());
  }
  void set(int id, Value value) { change({{id, std::move(value)}}); }
  void erase(int id) { change({{id, std::nullopt}}); }

 private:
  // Where the id's chunk is or would be.
  std::size_t chunk_of(int id) const {
    const auto at = std::lower_bound(chunks_.begin(), chunks_.end(), id / kChunk,
                                     [](const auto& chunk, int number) { return chunk.first < number; });
    return static_cast<std::size_t>(at - chunks_.begin());
  }
  bool is_chunk(std::size_t at, int id) const {
    return at < chunks_.size() && chunks_[at].first == id / kChunk;
  }
  // The id's chunk, made or taken from those that may share it, and its place.
  std::pair<std::size_t, std::shared_ptr<Chunk>> copy_chunk(int id) {
    const std::size_t at = chunk_of(id);
    auto own = is_chunk(at, id) ? std::make_shared<Chunk>(*chunks_[at].second) : std::make_shared<Chunk>();
    if (is_chunk(at, id)) {
      chunks_[at].second = own;
    } else {
      chunks_.insert(chunks_.begin() + static_cast<std::ptrdiff_t>(at), {id / kChunk, own});
    }
    return {at, own};
  }

  Chunks chunks_;
  std::size_t size_ = 0;
};

}  // namespace mono_pose_tracker
