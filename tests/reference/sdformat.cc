// What libsdformat, Gazebo's own reader, makes of an SDF file: errors and warnings, mass, centre,
// inertia, frames of the model; one line of JSON. `tests/campaigns/loaded.py` builds and runs it:
//   g++ -std=c++17 sdformat.cc -o sdformat $(pkg-config --cflags --libs sdformat12)
#include <cstdio>
#include <iostream>
#include <sdf/sdf.hh>

int main(int, char **argv) {
  sdf::Root root;
  sdf::Errors errors = root.Load(argv[1]);
  for (const auto &error : errors) std::cerr << error << "\n";
  const sdf::Model *model = root.Model();
  if (!errors.empty() || model == nullptr || model->LinkCount() != 1) return 1;
  const sdf::Link *link = model->LinkByIndex(0);
  const auto inertial = link->Inertial();
  const auto at = inertial.Pose().Pos();
  const auto moi = inertial.Moi();  // in the axes of the link
  std::printf("{\"mass\": %.17g, \"centre\": [%.17g, %.17g, %.17g], \"inertia\": [",
              inertial.MassMatrix().Mass(), at.X(), at.Y(), at.Z());
  for (int i = 0; i < 9; ++i) std::printf("%s%.17g", i ? ", " : "", moi(i / 3, i % 3));
  std::printf("], \"visuals\": %zu, \"collisions\": %zu, \"frames\": {",
              static_cast<size_t>(link->VisualCount()),
              static_cast<size_t>(link->CollisionCount()));
  for (uint64_t i = 0; i < model->FrameCount(); ++i) {
    const sdf::Frame *frame = model->FrameByIndex(i);
    ignition::math::Pose3d pose;
    const sdf::Errors unresolved = frame->SemanticPose().Resolve(pose, link->Name());
    for (const auto &error : unresolved) std::cerr << error << "\n";
    if (!unresolved.empty()) return 1;
    const auto &p = pose.Pos();
    const auto &q = pose.Rot();
    std::printf("%s\"%s\": [%.17g, %.17g, %.17g, %.17g, %.17g, %.17g, %.17g]", i ? ", " : "",
                frame->Name().c_str(), p.X(), p.Y(), p.Z(), q.W(), q.X(), q.Y(), q.Z());
  }
  std::printf("}}\n");
  return 0;
}
