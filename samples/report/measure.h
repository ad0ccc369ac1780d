// measure: one scene under the report's studies: solves, draws, times and judges; a JSON record for each job.
//
// A group is one study on one view at one budget: its variants are drawn in turn, again and again, so that whatever slows the machine for
// a while slows all of them. The truth is traced once for each view and light.
// Test: tests/report_test.cpp
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "job.h"
#include "plan.h"
#include "scene.h"

namespace gnomon::report {

struct Effort {
  int repetitions = 3;  // timed frames of each variant
  int steps = 2;  // along each path
};

// A picture for the page, encoded.
struct Shot {
  std::string name;  // file name: jpg or png
  std::vector<std::uint8_t> bytes;
};

// What identifies a job: equal keys, equal work.
[[nodiscard]] cli::Json keyOf(const Study& study, const std::string& scene, const offscreen::View& view, double texels,
                              const Variant& variant, const Effort& effort);

class Stage {
 public:
  // scene: a built-in's name or a .glb file. Throws std::runtime_error.
  Stage(offscreen::Renderer& renderer, const std::string& scene);
  ~Stage();

  [[nodiscard]] const std::vector<offscreen::View>& views() const { return views_; }

  // A record for each variant; `shots` takes the pictures of those that are pictured. The case file that a record's command names is
  // written into `folder`.
  [[nodiscard]] std::vector<cli::Json> measure(const Study& study, const offscreen::View& view, double texels, const Effort& effort,
                                               const std::string& folder, const std::function<void(const Shot&)>& shots);

 private:
  struct Seen;
  [[nodiscard]] Seen& look(const Study& study, const offscreen::View& view, const Effort& effort);

  offscreen::Renderer& renderer_;
  std::string scene_, name_;
  std::vector<offscreen::View> views_;
  Box bounds_;
  std::unique_ptr<offscreen::Tracer> tracer_;
  std::unique_ptr<Seen> seen_;  // the last view looked at
};

}  // namespace gnomon::report
