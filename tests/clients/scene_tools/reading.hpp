// Reads worlds from text, with a library of made-up files instead of a disk, for the tests of the importer's readers.
#pragma once

#include <gtest/gtest.h>

#include <map>
#include <string>

#include "clients/scene_tools/imported_world.hpp"

namespace sonar::scene_tools {

struct Reading {
  std::map<std::string, std::string> files;  // by their URI, for example model://crate
  ReadOptions options;
  Findings findings;

  Result<ImportedWorld> read(const std::string& text) {
    Library library;
    library.find = [this](std::string_view uri, const std::filesystem::path&) {
      return files.contains(std::string(uri)) ? std::filesystem::path(uri) : std::filesystem::path();
    };
    library.read = [this](const std::filesystem::path& path) -> Result<std::string> { return files.at(path.string()); };
    findings = {};
    return read_world(text, "w.sdf", library, options, findings);
  }
  std::string error(const std::string& text) {
    const auto world = read(text);
    return world ? "no error" : world.error().text;
  }
};

inline std::string sdf(const std::string& world) {
  return std::string("<sdf version=\"1.9\">\n<world name=\"w\">\n") + world + "\n</world>\n</sdf>";
}
/// Returns a link with a box of 1 x 2 x 3 m; `more` goes into the link, `visual` into its visual.
inline std::string link(const std::string& name, const std::string& more = "", const std::string& visual = "") {
  return std::string("<link name=\"") + name + "\">" + more + "<visual name=\"v\">" + visual +
         "<geometry><box><size>1 2 3</size></box></geometry></visual></link>";
}
inline std::string model(const std::string& name, const std::string& content) {
  return std::string("<model name=\"") + name + "\">" + content + "</model>";
}

inline void expect_near(Vec3d a, Vec3d b, double tolerance = 1e-9) {
  EXPECT_NEAR(a.x, b.x, tolerance);
  EXPECT_NEAR(a.y, b.y, tolerance);
  EXPECT_NEAR(a.z, b.z, tolerance);
}

}  // namespace sonar::scene_tools
