// Meshes that are cut short, and texts with damaged records, are refused with the place of the fault. What remains without a
// fault has all faces.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <chrono>
#include <cstdint>
#include <vector>

#include "core/scene/files/load_mesh.hpp"
#include "core/scene/import/check_mesh.hpp"
#include "tests/core/scene/temporary_files.hpp"

namespace sonar::cut_meshes_test {
namespace {

using ::testing::HasSubstr;

const std::string ply_head =
    "ply\nformat ascii 1.0\ncomment made by hand\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
    "element face 4\nproperty list uchar int vertex_indices\nelement edge 1\nproperty int vertex1\nproperty int vertex2\n"
    "end_header\n";
const std::string ply_vertices = "0 0 0\n2 0 0\n0 1 0\n0 0 3\n", ply_faces = "3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n",
                  ply_edge = "0 1\n", ply = ply_head + ply_vertices + ply_faces + ply_edge;
const std::string obj = "v 0 0 0\nv 2 0 0\nv 0 1 0\nv 0 0 3\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
const std::string stl =
    "solid part\n"
    "facet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 0 1 0\nvertex 2 0 0\nendloop\nendfacet\n"
    "facet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 2 0 0\nvertex 0 0 3\nendloop\nendfacet\n"
    "endsolid part\n";

std::string replaced(std::string text, const std::string& old, const std::string& by) {
  const std::size_t at = text.find(old);
  EXPECT_NE(at, text.npos) << old;
  return text.replace(at, old.size(), by);
}

class CutMeshes : public ::testing::Test {
 protected:
  /// Returns e.g. "4 triangles", or the error.
  std::string loaded(const std::string& name, const std::string& text) {
    const auto mesh = load_mesh({.file = files_.write(name, text)});
    return mesh ? std::to_string(mesh->centred.mesh.triangles.size()) + " triangles" : mesh.error().text;
  }
  tests::TemporaryFiles files_;
};

TEST(CutMeshTexts, EveryCutOfAPlyIsFoundUpToItsLastRecord) {
  ASSERT_EQ(check_ply_records(ply), std::nullopt);
  for (std::size_t n = ply_head.size(); n < ply.size() - 2; ++n) EXPECT_TRUE(check_ply_records(ply.substr(0, n))) << n;
  EXPECT_FALSE(check_ply_records(ply.substr(0, ply.size() - 1))) << "the last line end may be missing";
}

/// Appends the number's bytes, in this machine's order or reversed.
template <class T>
void append(std::string& bytes, T number, bool is_reversed) {
  auto as_bytes = std::bit_cast<std::array<char, sizeof number>>(number);
  if (is_reversed) std::reverse(as_bytes.begin(), as_bytes.end());
  bytes.append(as_bytes.data(), as_bytes.size());
}

TEST_F(CutMeshes, EveryCutOfABinaryPlyIsFound) {
  for (const bool is_big : {false, true}) {
    std::string bytes = std::string("ply\nformat binary_") + (is_big ? "big" : "little") +
                        "_endian 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty double z\n"
                        "element face 2\nproperty uchar red\nproperty list ushort int vertex_indices\nend_header\n";
    const std::size_t head = bytes.size();
    for (const float corner : {0.F, 1.F, 2.F, 3.F}) {
      append(bytes, corner, is_big);
      append(bytes, corner * corner, is_big);
      append(bytes, 1.0, is_big);
    }
    for (const std::vector<int>& face : {std::vector<int>{0, 1, 2}, {0, 1, 2, 3}}) {
      bytes += "r";
      append(bytes, static_cast<std::uint16_t>(face.size()), is_big);
      for (const int corner : face) append(bytes, corner, is_big);
    }
    EXPECT_EQ(check_ply_records(bytes), std::nullopt);
    EXPECT_EQ(loaded("whole.ply", bytes), "3 triangles");
    for (std::size_t n = head; n < bytes.size(); ++n) EXPECT_TRUE(check_ply_records(bytes.substr(0, n))) << n;
    EXPECT_THAT(check_ply_records(bytes.substr(0, head + 20)).value_or(""), HasSubstr("ends within vertex 2 of 4"));
    EXPECT_THAT(loaded("cut.ply", bytes.substr(0, bytes.size() - 1)),
                HasSubstr("ends within face 2 of 2, which its header counts; it is cut short or damaged, export it again"));
  }
}

TEST_F(CutMeshes, EveryCheckReadsTheSameHeaderOfAPly) {
  std::string returns = ply;
  for (std::size_t at = 0; (at = returns.find('\n', at)) != returns.npos; at += 2) returns.insert(at, "\r");
  const std::string capitals = replaced(replaced(ply, "element vertex", "ELEMENT VERTEX"), "format ascii", "Format\tASCII");
  for (const std::string& text : {returns, capitals}) {
    const PlyHead head = ply_head_of(text);
    EXPECT_EQ(text.substr(head.bytes, 5), "0 0 0");
    EXPECT_TRUE(head.is_text);
    EXPECT_EQ(head.faces(), 4u);
    ASSERT_EQ(head.elements.size(), 3u);
    EXPECT_EQ(head.elements[1].properties.size(), 1u);
    EXPECT_EQ(check_ply(head, text.size()), std::nullopt);
    EXPECT_EQ(check_ply_records(text), std::nullopt);
    EXPECT_EQ(loaded("a.ply", text), "4 triangles");
  }
  // The importer, too, treats a carriage return within a comment as the end of the line.
  const std::string many = replaced(ply, "made by hand", "made by\relement vertex 1000000");
  EXPECT_EQ(ply_head_of(many).elements.size(), 4u);
  EXPECT_THAT(check_ply(ply_head_of(many), many.size()).value_or(""), HasSubstr("says that it has 1000000 of \"vertex\""));
}

TEST(CutMeshTexts, EveryCutOfAnStlIsFoundUpToItsEnd) {
  ASSERT_EQ(check_stl_text(stl), std::nullopt);
  for (std::size_t n = 0; n < stl.rfind(" part"); ++n) EXPECT_TRUE(check_stl_text(stl.substr(0, n))) << n;
  EXPECT_FALSE(check_stl_text(stl.substr(0, stl.size() - 1))) << "the last line end may be missing";
}

// An OBJ file has no counts, so a cut between records cannot be found.
TEST(CutMeshTexts, EveryCutOfAnObjWithinARecordIsFound) {
  ASSERT_EQ(check_obj(obj), std::nullopt);
  for (std::size_t n = 1; n < obj.size(); ++n) {
    const std::string text = obj.substr(0, n), line = text.substr(text.rfind('\n') + 1);
    const bool within = !line.empty() && (line[0] == 'v' || line[0] == 'f') && (line.size() < 6 || line.back() == ' ');
    EXPECT_EQ(check_obj(text).has_value(), within && line.size() < 7) << text;
  }
}

TEST_F(CutMeshes, AreRefusedWithThePlaceOfTheCut) {
  const std::string again = "; it is cut short or damaged, export it again";
  EXPECT_EQ(loaded("a.ply", ply), "4 triangles");
  EXPECT_EQ(loaded("a.ply", ply_head + ply_vertices + "3 0 2 1\n3 0 1 3\n"),
            "a.ply: ends before face 3 of 4, which its header counts" + again);
  EXPECT_EQ(loaded("a.ply", ply_head + ply_vertices + "3 0 2 1\n3 0"), "a.ply: face 2 of 4 (line 19) has 2 of 4 values" + again);
  EXPECT_EQ(loaded("a.ply", ply_head + "0 0 0\n2 0"), "a.ply: vertex 2 of 4 (line 15) has 2 of 3 values" + again);
  EXPECT_EQ(loaded("a.ply", ply_head + ply_vertices + ply_faces),
            "a.ply: ends before edge 1 of 1, which its header counts" + again);
  EXPECT_EQ(loaded("a.stl", stl), "2 triangles");
  EXPECT_EQ(loaded("a.stl", stl.substr(0, stl.find("vertex 2"))), "a.stl: ends within facet 1 (line 5)" + again);
  EXPECT_EQ(loaded("a.stl", stl.substr(0, stl.rfind("0 3"))), "a.stl: ends within facet 2 (line 13)" + again);
  EXPECT_EQ(loaded("a.stl", stl.substr(0, stl.find("endsolid"))), "a.stl: ends after facet 2 (line 15) without endsolid" + again);
  EXPECT_EQ(loaded("a.obj", obj), "4 triangles");
  EXPECT_EQ(loaded("a.obj", obj.substr(0, obj.rfind(" 4"))), "a.obj: ends within a face (line 8) of 2 corners" + again);
  EXPECT_EQ(loaded("a.obj", obj + "v 1 2"), "a.obj: vertex 5 (line 9) has 2 numbers, not 3, 4 or 6" + again);
}

TEST_F(CutMeshes, DamagedRecordsAmongOthersAreRefusedToo) {
  EXPECT_THAT(loaded("a.ply", replaced(ply, "0 1 0\n", "0 1\n")), HasSubstr("vertex 3 of 4 (line 16) has 2 of 3 values"));
  EXPECT_THAT(loaded("a.ply", replaced(ply, "2 0 0\n", "2 x 0\n")), HasSubstr("vertex 2 of 4 (line 15) has \"x\", which is not"));
  EXPECT_THAT(loaded("a.ply", replaced(ply, "3 0 1 3\n", "3 0 1\n")), HasSubstr("face 2 of 4 (line 19) has 3 of 4 values"));
  EXPECT_THAT(loaded("a.ply", replaced(ply, "0 0 0\n2 0 0\n", "0 0 0 2 0 0\n")), HasSubstr("ends before edge 1 of 1"));
  EXPECT_THAT(loaded("a.ply", replaced(ply, "2 0 0\n", "2 0 0\n\n\n")), HasSubstr("vertex 3 of 4 (line 17) has 0 of 3 values"));
  EXPECT_THAT(loaded("a.ply", replaced(ply, "2 0 0\n", "2 0 0\n\r\n")), HasSubstr("vertex 3 of 4 (line 16) has 0 of 3 values"));
  EXPECT_THAT(loaded("a.stl", replaced(stl, "vertex 0 1 0\n", "")), HasSubstr("facet 1 (line 7) has 2 corners, not 3"));
  EXPECT_THAT(loaded("a.stl", replaced(stl, "vertex 0 1 0\n", "vertex 0 1\n")), HasSubstr("facet 1 (line 6) has a corner with"));
  EXPECT_THAT(loaded("a.stl", replaced(stl, "endloop\n", "vertex 1 1 1\nendloop\n")), HasSubstr("has 4 corners, not 3"));
  EXPECT_THAT(loaded("a.obj", replaced(obj, "v 0 1 0", "v 0 1")), HasSubstr("vertex 3 (line 3) has 2 numbers, not 3, 4 or 6"));
  EXPECT_THAT(loaded("a.obj", replaced(obj, "v 0 1 0", "v 0 1 0 1 1 1 1")), HasSubstr("has 7 numbers, not 3, 4 or 6; export it"));
}

TEST_F(CutMeshes, UnusualTextsWithoutAFaultAreRead) {
  std::string lines = ply, one_line = stl;
  for (std::size_t at = 0; (at = lines.find('\n', at)) != lines.npos; at += 2) lines.replace(at, 1, "\r\n");
  std::replace(one_line.begin(), one_line.end(), '\n', ' ');
  const std::string unclosed = replaced(replaced(stl, "endfacet\n", ""), "endfacet\n", "");
  for (const std::string& text : {lines, ply_head + "\n" + ply_vertices + "\n" + ply_faces + ply_edge,
                                  ply_head + "0 0 0 7\n2 0 0\n0 1 0\n0 0 3\n" + ply_faces + ply_edge})
    EXPECT_EQ(loaded("a.ply", text), "4 triangles") << text;
  for (const std::string& text : {stl + "\n", one_line, unclosed, "\n" + stl}) EXPECT_EQ(loaded("a.stl", text), "2 triangles");
  EXPECT_EQ(loaded("a.stl", stl + stl), "4 triangles");
  for (const std::string& text : {replaced(stl, "endsolid part", "end solid part"), stl + "made by a solid program\n"})
    EXPECT_EQ(check_stl_text(text), std::nullopt) << text;
  for (const char* by :
       {"v 2 0 0 1", "v 2 0 0 0.5 0.5 0.5", "v 2 0 0 # corner", "v 2 0 0 // base", "v 2 0 \\\n0", "v\t2\t0\t0\r"})
    EXPECT_EQ(loaded("a.obj", replaced(obj, "v 2 0 0", by)), "4 triangles") << by;
  EXPECT_EQ(loaded("a.obj", obj + "f 1 2\n"), "4 triangles") << "a line, not a face";
}

// The search for a facet after the name of a solid must not read the rest of the line again for each solid.
TEST(CutMeshTexts, ALineWithManySolidsTakesLittleTime) {
  std::string text;
  for (int k = 0; k < 40'000; ++k)
    text += "solid a facet normal 0 0 0 outer loop vertex 0 0 0 vertex 0 1 0 vertex 2 0 0 endloop endfacet endsolid a ";
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_EQ(check_stl_text(text), std::nullopt);
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(30));  // 0.3 s; copies of each rest took 70 s and more
}

// Only the vertices of a face are needed; the number 0 instead of a texture coordinate or normal does no harm.
TEST_F(CutMeshes, ObjFacesWithTheIndexZeroAreReadByTheirVertices) {
  for (const char* by : {"f 1/0/1 3/0/1 2/0/1", "f 1/0 3/0 2/0", "f 1//0 3//0 2//0", "f 1/1/0 3/0/0 2"})
    EXPECT_EQ(loaded("a.obj", replaced(obj, "f 1 3 2", by)), "4 triangles") << by;
  const auto mesh = load_mesh({.file = files_.write("a.obj", replaced(obj, "f 1 3 2", "f 0/1/1 3/1/1 2/1/1"))});
  ASSERT_TRUE(mesh);
  EXPECT_EQ(mesh->centred.mesh.triangles.size(), 3u);
  EXPECT_EQ(mesh->lost, 1u) << "no vertex has the number 0";
}

}  // namespace
}  // namespace sonar::cut_meshes_test
