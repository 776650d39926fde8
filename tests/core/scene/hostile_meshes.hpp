// Mesh files that crashed the program that read them, or exhausted its memory. Small ones are also seeds of mesh_file_fuzz
// (tests/fuzz/corpus/mesh_file): with SONARD_WRITE_SEEDS=folder the test writes them.
#pragma once

#include <string>
#include <vector>

namespace sonar::tests {

struct HostileMesh {
  std::string name, bytes;
  std::string words;  // words that the error must contain
};

inline std::string repeated(const std::string& text, int times) {
  std::string out;
  for (int i = 0; i < times; ++i) out += text;
  return out;
}

inline std::string collada_scene(const std::string& nodes, const std::string& library = "") {
  return "<?xml version=\"1.0\"?><COLLADA xmlns=\"http://www.collada.org/2005/11/COLLADASchema\" version=\"1.4.1\">" + library +
         "<library_visual_scenes><visual_scene id=\"s\">" + nodes +
         "</visual_scene></library_visual_scenes><scene><instance_visual_scene url=\"#s\"/></scene></COLLADA>";
}

/// Returns `nodes` nodes, each of which contains the next one `times` times.
inline std::string gltf_nodes(int nodes, int times) {
  std::string list;
  for (int i = 1; i <= nodes; ++i) {
    list += "{\"children\":[" + std::to_string(i);
    for (int k = 1; k < times; ++k) list += "," + std::to_string(i);
    list += "]},";
  }
  return R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[)" + list + "{}]}";
}

/// Returns one triangle. Its corners are in the file that `uri` names.
inline std::string gltf_with_buffer(const std::string& uri) {
  return R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],)"
         R"("meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],"buffers":[{"byteLength":36,"uri":")" +
         uri +
         R"("}],"bufferViews":[{"buffer":0,"byteLength":36}],"accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}]})";
}

inline std::string ply_header(const std::string& format, const std::string& vertices, const std::string& faces,
                              const std::string& count_type = "uchar") {
  return "ply\nformat " + format + " 1.0\nelement vertex " + vertices +
         "\nproperty float x\nproperty float y\nproperty float z\nelement face " + faces + "\nproperty list " + count_type +
         " int vertex_indices\nend_header\n";
}

inline std::vector<HostileMesh> hostile_meshes() {
  std::string library;
  for (int i = 0; i < 24; ++i) {
    const std::string next = "<instance_node url=\"#n" + std::to_string(i + 1) + "\"/>";
    library += "<node id=\"n" + std::to_string(i) + "\">" + next + next + "</node>";
  }
  const std::string three_vertices("\0\0\0\0\0\0\0\0\0\0\0\0\0\0\x80\x3f\0\0\0\0\0\0\0\0\0\0\0\0\0\0\x80\x3f\0\0\0\0", 36);
  const std::string indices("\0\0\0\0\1\0\0\0\2\0\0\0", 12);
  const std::string itself = "contains itself", multiplies = "repeats its nodes", deep = "deeper than", huge = "cannot hold";
  return {
      {"loop.dae", collada_scene("<node id=\"n\"><instance_node url=\"#n\"/></node>"), itself},
      {"ring.dae",
       collada_scene(
           "<node id=\"a\"><instance_node url=\"#b\"/></node><node id='b'><node><instance_node url='#a'/></node></node>"),
       itself},
      {"by-name.dae", collada_scene("<node name=\"n\"><instance_node url=\"#n\"/></node>"), itself},
      {"scene.dae", collada_scene("<node><instance_node url=\"#s\"/></node>"), itself},
      {"fan.dae",
       collada_scene("<node><instance_node url=\"#n0\"/></node>",
                     "<library_nodes>" + library + "<node id=\"n24\"/></library_nodes>"),
       multiplies},
      {"deep.dae", collada_scene(repeated("<node>", 30'000) + repeated("</node>", 30'000)), deep},
      {"array.dae",
       collada_scene("",
                     "<library_geometries><geometry id='g'><mesh><source id='p'><float_array id='a' count='4000000000'>0 "
                     "0</float_array></source></mesh></geometry></library_geometries>"),
       huge},
      {"brackets.gltf", std::string(200'000, '['), deep},
      {"objects.gltf", repeated("{\"a\":", 200'000), deep},
      {"deep.gltf", gltf_nodes(20'000, 1), deep},
      {"nested.dae", collada_scene(repeated("<node>", 501) + repeated("</node>", 501)), deep},  // small: seeds
      {"nested.gltf", std::string(201, '['), deep},
      {"nodes.gltf", gltf_nodes(201, 1), deep},
      {"fan.gltf", gltf_nodes(24, 2), multiplies},
      {"itself.gltf", R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"children":[0]}]})", itself},
      {"named.gltf",
       R"({"asset":{"version":"1.0"},"scene":"s","scenes":{"s":{"nodes":["a"]}},"nodes":{"a":{"children":["b"]},"b":{"children":["a"]}}})",
       itself},
      {"vertices.ply", ply_header("binary_little_endian", "2000000000", "1"), huge},
      {"text.ply", ply_header("ascii", "2000000000", "1"), huge},
      {"faces.ply", ply_header("binary_little_endian", "3", "1000000000") + three_vertices, huge},
      {"endless.ply", ply_header("ascii", "99999999999999999999", "1"), huge},
      {"list.ply", ply_header("binary_little_endian", "3", "1", "uint") + three_vertices + "\xff\xff\xff\x7f" + indices,
       "ends within face 1 of 1"},
      {"text-list.ply", ply_header("ascii", "3", "1", "uint") + "0 0 0\n1 0 0\n0 1 0\n2147483647 0 1 2\n",
       "face 1 of 1 (line 13) has 4 of 2147483648 values"},
      {"absolute.gltf", gltf_with_buffer("/etc/passwd"), "names the file /etc/passwd, an absolute path"},
      {"outside.gltf", gltf_with_buffer("../../../../../../etc/passwd"),
       "etc/passwd, which is outside of its folder and the scene's"},
      {"own.gltf", gltf_with_buffer("own.gltf"), "names itself as the file of a buffer (own.gltf)"},
      {"own-dots.gltf", gltf_with_buffer("x/.././own%2ddots.gltf"), "names itself as the file of a buffer"},
      {"empty.gltf", gltf_with_buffer(""), "referenced file"},
      {"long.gltf", gltf_with_buffer(repeated("x/../", 600'000) + "long.gltf"),
       "names the file of a buffer with 3000009 characters; put the file beside it"},
  };
}

}  // namespace sonar::tests
