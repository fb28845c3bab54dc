#include "io/yaml_file.h"

#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/yaml.h>

#include <map>
#include <set>
#include <sstream>
#include <stdexcept>

#include "common/text.h"
#include "io/text_file.h"

namespace mono_pose_tracker {
namespace {

// A calibration has 1 kB and some tens of values, config/default.yaml 12 kB and a hundred, in two levels.
constexpr std::size_t kMaxBytes = 256 * 1024;
constexpr std::size_t kMaxDepth = 20;
constexpr std::size_t kMaxValues = 20000;

[[noreturn]] void fail(int line, const std::string& problem) {
  throw std::runtime_error("line " + std::to_string(line) + " " + problem);
}

std::size_t count_values(const YamlValue& value) {
  std::size_t count = 1;
  for (const YamlValue& item : value.items) count += count_values(item);
  for (const auto& entry : value.entries) count += 1 + count_values(entry.second);
  return count;
}

/// Makes the value out of the parser's events, so that nothing is built that the limits refuse.
class Builder : public YAML::EventHandler {
 public:
  YamlValue take() { return std::move(root_); }

  // A comma behind the first makes yaml-cpp begin one empty document after the other, for ever.
  void OnDocumentStart(const YAML::Mark& mark) override {
    if (++documents_ > 2) fail_by_second_document(mark);
  }
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    if (documents_ > 1 && open_.empty()) return;  // a line of dashes at the end
    add(leaf(YamlValue::Kind::kNothing, "", mark), anchor);
  }
  void OnScalar(const YAML::Mark& mark, const std::string&, YAML::anchor_t anchor,
                const std::string& text) override {
    add(leaf(YamlValue::Kind::kText, text, mark), anchor);
  }
  void OnAlias(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    const auto found = anchored_.find(anchor);
    if (found == anchored_.end()) fail(mark.line + 1, "has an alias of a value that contains this alias");
    count(count_values(found->second), mark);
    add(found->second, YAML::NullAnchor);
  }
  void OnSequenceStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t anchor,
                       YAML::EmitterStyle::value) override {
    open(YamlValue::Kind::kList, mark, anchor);
  }
  void OnSequenceEnd() override { close(); }
  void OnMapStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t anchor,
                  YAML::EmitterStyle::value) override {
    open(YamlValue::Kind::kMap, mark, anchor);
  }
  void OnMapEnd() override { close(); }

 private:
  /// A list or map whose end has not come yet.
  struct Open {
    YamlValue value;
    YAML::anchor_t anchor = YAML::NullAnchor;
    std::set<std::string> keys;
    std::string key;  // whose value comes next
    bool has_key = false;
  };

  [[noreturn]] static void fail_by_second_document(const YAML::Mark& mark) {
    fail(mark.line + 1, "starts a second document, which would be ignored");
  }

  YamlValue leaf(YamlValue::Kind kind, const std::string& text, const YAML::Mark& mark) {
    if (documents_ > 1) fail_by_second_document(mark);
    count(1, mark);
    YamlValue value;
    value.kind = kind;
    value.line = mark.line + 1;
    value.text = text;
    return value;
  }

  void open(YamlValue::Kind kind, const YAML::Mark& mark, YAML::anchor_t anchor) {
    if (open_.size() >= kMaxDepth) {
      fail(mark.line + 1, "is nested more than " + std::to_string(kMaxDepth) + " levels deep");
    }
    Open opened;
    opened.value = leaf(kind, "", mark);
    opened.anchor = anchor;
    open_.push_back(std::move(opened));
  }

  void close() {
    Open closed = std::move(open_.back());
    open_.pop_back();
    add(std::move(closed.value), closed.anchor);
  }

  void add(YamlValue value, YAML::anchor_t anchor) {
    if (anchor != YAML::NullAnchor) anchored_[anchor] = value;
    if (open_.empty()) {
      root_ = std::move(value);
      return;
    }
    Open& parent = open_.back();
    if (parent.value.kind == YamlValue::Kind::kList) {
      parent.value.items.push_back(std::move(value));
    } else if (parent.has_key) {
      parent.value.entries.emplace_back(std::move(parent.key), std::move(value));
      parent.has_key = false;
    } else {
      take_key(value, &parent);
    }
  }

  static void take_key(const YamlValue& value, Open* map) {
    if (value.kind != YamlValue::Kind::kText) fail(value.line, "has a key that is not a text");
    if (!map->keys.insert(value.text).second) {
      fail(value.line, "has the key " + value.text + " a second time");
    }
    map->key = value.text;
    map->has_key = true;
  }

  void count(std::size_t values, const YAML::Mark& mark) {
    values_ += values;
    if (values_ > kMaxValues) {
      fail(mark.line + 1,
           "has more than " + std::to_string(kMaxValues) + " values when aliases are expanded");
    }
  }

  YamlValue root_;
  std::vector<Open> open_;
  std::map<YAML::anchor_t, YamlValue> anchored_;
  std::size_t values_ = 0;
  int documents_ = 0;
};

}  // namespace

const YamlValue* YamlValue::find(const std::string& key) const {
  for (const auto& entry : entries) {
    if (entry.first == key) return &entry.second;
  }
  return nullptr;
}

YamlValue parse_yaml(const std::string& content, const std::string& expected) {
  Builder builder;
  try {
    std::istringstream stream(content);
    YAML::Parser parser(stream);
    while (parser.HandleNextDocument(builder)) {
    }
  } catch (const YAML::Exception& error) {
    fail(error.mark.line + 1, "is not valid YAML (" + one_line(error.msg) + "): expected " + expected);
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(one_line(error.what()) + ": expected " + expected);
  }
  return builder.take();
}

YamlValue read_yaml_file(const std::string& path, const std::string& expected) {
  const std::string content = read_text_file(path, expected, kMaxBytes);
  try {
    return parse_yaml(content, expected);
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(path + ": " + error.what());
  }
}

}  // namespace mono_pose_tracker
