// The simpler objects that handles refer to: pings, images, range lists, navigation, generators, mappers, discovery agents.
// Sonars and heads have files of their own. The facades lock an object's mutex around each call on it.
#pragma once

#include "clients/bvtsdk/core/colour_maps.hpp"
#include "clients/bvtsdk/core/description.hpp"
#include "clients/bvtsdk/core/handles.hpp"
#include "clients/bvtsdk/core/imaging.hpp"
#include "clients/bvtsdk/core/range_list.hpp"

namespace sonar::bvt {

struct NavObject : Object {
  NavData nav;
};

struct MagImageObject : Object {
  MagImage image;
};

struct ColourImageObject : Object {
  ColourImage image;
};

struct RangeListObject : Object {
  RangeList list;
};

struct ColourMapperObject : Object {
  ColourMapper mapper;
};

struct DiscoveryObject : Object {
  DiscoveryAgent agent;
};

/// Image settings of a head. Each ping keeps a copy of the settings at its time, for BVTPing_GetImage and related functions.
struct HeadImaging {
  ImageType type = ImageType::xy;
  ImageSettings image;
  RangeListSettings ranges;
};

struct PingObject : Object {
  PolarPing polar;
  HeadDescription settings;  // settings of the head when this ping was made
  HeadImaging imaging;
  std::shared_ptr<Imager> imager;  // shared with the head, so that its tables are used again
  void* range_data = nullptr;      // 3.x: belongs to the ping and is destroyed with it
  ~PingObject() override {
    if (range_data) handles().remove<RangeListObject>(range_data);
  }
};

/// Makes images of pings; only the 4.x interface has it.
struct ImageGeneratorObject : Object {
  bool has_head = false;
  ImageSettings image;
  RangeListSettings ranges;
  Imager imager;
};

}  // namespace sonar::bvt
