#include <utility>

#include "protocol/dvl/dvl.hpp"
#include "protocol/dvl/reports.hpp"
#include "protocol/dvl/session.hpp"

namespace sonar::dvl {
namespace {

using protocol::Reaction;

constexpr std::size_t longest_command = 4096;
constexpr int deepest_command = 8;  // nested braces (our choice)

/// Finds the JSON objects in a stream by counting braces, because libwaterlinked sends no line ends between objects.
class ObjectSplitter {
 public:
  /// Returns the object that ends with this byte.
  std::optional<std::string> add(char c) {
    if (depth_ == 0) {
      if (c == '{') {
        object_ = c;
        depth_ = 1;
        in_text_ = escapes_ = false;
      } else if (c != '\n' && c != '\r' && c != ' ' && c != '\t') {
        ++junk_;
      }
      return std::nullopt;
    }
    object_ += c;
    if (in_text_) {  // braces within a text do not count, and an escaped quote does not end it
      if (!std::exchange(escapes_, !escapes_ && c == '\\') && c == '"') in_text_ = false;
    } else if (c == '"') {
      in_text_ = true;
    } else if (c == '{') {
      ++depth_;
    } else if (c == '}' && --depth_ == 0) {
      return std::exchange(object_, {});
    }
    // An object that is too long or too deep is dropped. The following bytes are read as a new stream.
    if (object_.size() < longest_command && depth_ <= deepest_command) return std::nullopt;
    junk_ += object_.size();
    depth_ = 0;
    object_.clear();
    return std::nullopt;
  }
  std::size_t take_junk() { return std::exchange(junk_, 0); }

 private:
  std::string object_;
  int depth_ = 0;
  bool in_text_ = false, escapes_ = false;
  std::size_t junk_ = 0;
};

class JsonDialogue final : public Session {
 public:
  using Session::Session;

  Reaction on_bytes(BytesView received, Time now) override {
    Reaction reaction;
    for (const std::byte b : received)
      if (const auto object = splitter_.add(static_cast<char>(b))) on_object(*object, now, reaction);
    if (const std::size_t junk = splitter_.take_junk(); junk > 0)
      reaction.events.emplace_back(protocol::Notice{std::to_string(junk) + " bytes that are not a command"});
    return reaction;
  }

 private:
  Bytes position_report(Time stamp) const override { return position_line(extrapolated(settings().reckoning, stamp), stamp); }

  void on_object(const std::string& object, Time now, Reaction& reaction) {
    const Json message = Json::parse(object, nullptr, false);
    const auto named = message.is_object() ? message.find("command") : message.end();
    if (named == message.end() || !named->is_string()) {
      reaction.replies.push_back(response_line("", {.error = "the message is not a command"}));
      return;
    }
    const std::string command = named->get<std::string>();
    const auto parameters = message.find("parameters");
    const auto outcome = execute(command, parameters != message.end() ? *parameters : Json(), now, reaction);
    reaction.replies.push_back(response_line(command, outcome.value_or(Outcome{.error = "there is no such command"})));
  }

  ObjectSplitter splitter_;
};

}  // namespace

std::unique_ptr<protocol::Dialogue> converse_in_json(const protocol::DeviceState& device, Time now) {
  return std::make_unique<JsonDialogue>(device, now);
}

}  // namespace sonar::dvl
