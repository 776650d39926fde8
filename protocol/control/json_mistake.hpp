// Finds the mistake in the JSON form of a control message, by the message's descriptor. protobuf 3.21 reports mistakes only as
// an English sentence: its status has one code for all mistakes, and the interface that reports field and value is not
// installed.
#pragma once

#include <string>
#include <string_view>

namespace google::protobuf {
class Descriptor;
}

namespace sonar::control {

/// In quotes, on one line; long texts are cut.
std::string in_quotes(const std::string& name);

/// The first mistake in valid JSON that protobuf has refused for a message of this type: "\"mount.xyz_m\": unknown key". Empty
/// if none was found.
std::string mistake_in(std::string_view json, const google::protobuf::Descriptor& type);

}  // namespace sonar::control
