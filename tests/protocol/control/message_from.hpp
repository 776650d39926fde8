// Makes messages of control.proto from protobuf's text format: `name: "front" range_m: 5`.
#pragma once

#include <google/protobuf/text_format.h>

#include <stdexcept>
#include <string>

#include "protocol/control/answers.hpp"

namespace sonar::control {

template <class Message>
Message message_from(const std::string& text) {
  Message message;
  if (!google::protobuf::TextFormat::ParseFromString(text, &message)) throw std::invalid_argument(text);
  return message;
}

}  // namespace sonar::control
