// The module meniscus._core: devices, particles and extract(), as bare as they can be. What people
// see, with its defaults and checks of types, is Python (meniscus/__init__.py).
#include "bindings.hpp"

#include <nanobind/stl/array.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/unique_ptr.h>
#include <nanobind/stl/vector.h>

#include <memory>
#include <optional>
#include <tuple>
#include <utility>

#include "meniscus/device.hpp"
#include "meniscus/named_parameters.hpp"
#include "meniscus/session.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace meniscus::python {
namespace {

/// Where an array lies: address of its first value, entries, bytes from one entry to the next and
/// from one component of an entry to the next, whether its values are doubles.
using Place = std::tuple<std::uintptr_t, std::size_t, std::ptrdiff_t, std::ptrdiff_t, bool>;

Column column(const Place& place, int component) {
  const auto [address, size, step, between, wide] = place;
  const std::uintptr_t first =
      address + static_cast<std::uintptr_t>(static_cast<std::ptrdiff_t>(component) * between);
  if (wide) return Column(reinterpret_cast<const double*>(first), size, step);
  return Column(reinterpret_cast<const float*>(first), size, step);
}

using NamedPlace = std::pair<std::string, Place>;

BorrowedParticles borrow(const Place& points, const std::optional<Place>& velocities,
                         const std::optional<Place>& radii, double particle_radius,
                         const std::vector<NamedPlace>& attributes) {
  BorrowedParticles borrowed;
  borrowed.x = column(points, 0);
  borrowed.y = column(points, 1);
  borrowed.z = column(points, 2);
  if (velocities) {
    borrowed.vx = column(*velocities, 0);
    borrowed.vy = column(*velocities, 1);
    borrowed.vz = column(*velocities, 2);
  }
  if (radii) borrowed.radius = column(*radii, 0);
  borrowed.particle_radius = particle_radius;
  for (const auto& [name, place] : attributes)
    borrowed.attributes.push_back({name, column(place, 0)});
  return borrowed;
}

/// A frame of particles, in memory that Python keeps alive, in memory of its own or in a file.
struct Frame {
  std::unique_ptr<Particles> own;
  std::unique_ptr<ParticleSource> source;
};

ReadOptions reading(double particle_radius, const std::vector<std::string>& attributes,
                    const std::string& dataset, std::int64_t timestep) {
  return {particle_radius, attributes, dataset, timestep};
}

/// Each stage looks for ctrl-C and calls `progress`, each notice calls `on_notice`, with the GIL.
Session::Settings watched(std::size_t memory, const nb::object& progress,
                          const nb::object& on_notice) {
  return {memory,
          [&progress](const std::string& stage) {
            const nb::gil_scoped_acquire locked;
            if (PyErr_CheckSignals() != 0) throw nb::python_error();
            if (!progress.is_none()) progress(stage);
          },
          [&on_notice](const Notice& notice) {
            const nb::gil_scoped_acquire locked;
            if (!on_notice.is_none()) on_notice(notice_of(notice));
          }};
}

std::unique_ptr<Made> extract_frame(Session& session, const Frame& frame, const Camera& camera,
                                    const Parameters& parameters, std::size_t memory, bool timed,
                                    const nb::object& progress, const nb::object& on_notice) {
  auto made = std::make_unique<Made>();
  made->parameters = parameters;
  const nb::gil_scoped_release released;
  made->surface =
      session.extract(*frame.source, camera, parameters, watched(memory, progress, on_notice),
                      timed ? &made->timings : nullptr);
  return made;
}

void add_whitewater(Session& session, Made& made,
                    const std::vector<std::pair<std::string, const Frame*>>& frames,
                    std::size_t memory, bool timed, const nb::object& progress,
                    const nb::object& on_notice) {
  std::vector<WhitewaterSource> sources;
  for (const auto& [type, frame] : frames)
    sources.push_back({.type = whitewater_named(type), .particles = frame->source.get()});
  const nb::gil_scoped_release released;
  session.draw_whitewater(sources, made.parameters, made.surface,
                          watched(memory, progress, on_notice), timed ? &made.timings : nullptr);
}

std::unique_ptr<Made> close_frame(Session& session, const Frame& frame, double cell,
                                  double adaptive, std::size_t memory, const Parameters& parameters,
                                  const nb::object& progress, const nb::object& on_notice) {
  auto made = std::make_unique<Made>();
  made->parameters = parameters;
  const nb::gil_scoped_release released;
  made->surface = session.extract_closed(*frame.source, {cell, adaptive, memory}, parameters,
                                         watched(kStreamMemory, progress, on_notice));
  return made;
}

nb::object error_class(const char* name) {
  return nb::module_::import_("meniscus._errors").attr(name);
}

void translate(const std::exception_ptr& thrown, void*) {
  const auto raise = [](const char* name, const Error& error) {
    const nb::object made = error_class(name)(error.what());
    made.attr("notice") = notice_of(error.notice);
    PyErr_SetObject(error_class(name).ptr(), made.ptr());
  };
  try {
    std::rethrow_exception(thrown);
  } catch (const Cancelled& error) {
    raise("Cancelled", error);
  } catch (const OutOfDeviceMemory& error) {
    raise("OutOfDeviceMemory", error);
  } catch (const DeviceError& error) {
    raise("DeviceError", error);
  } catch (const InputError& error) {
    raise(error.notice.code == Code::missing_file ? "MissingFileError" : "InputError", error);
  } catch (const OutputError& error) {
    raise("OutputError", error);
  } catch (const InvalidArgument& error) {
    raise("InvalidArgument", error);
  } catch (const Error& error) {
    raise("Error", error);
  }
}

using Named = nb::typed<nb::dict, nb::str, nb::any>;

Named info_of(const DeviceInfo& info) {
  nb::dict all;
  all["index"] = info.index;
  all["name"] = info.name;
  all["platform"] = info.platform;
  all["vendor"] = info.vendor;
  all["version"] = info.version;
  all["driver"] = info.driver;
  all["kind"] = to_string(info.kind);
  all["compute_units"] = info.compute_units;
  all["global_memory"] = info.global_memory;
  all["usable"] = info.usable;
  all["problem"] = info.problem;
  return Named(all);
}

// What a Particles of Python shows of a frame in memory of its own: it lives as long as `owner`.
std::optional<Array<float>> shared(nb::handle owner, std::vector<float>& values) {
  if (values.empty()) return {};
  return Array<float>(values.data(), {values.size()}, owner);
}

void bind_parameters(nb::module_& module) {
  nb::class_<Parameters>(module, "Parameters")
      .def(nb::init<>())
      .def_rw("particle_radius", &Parameters::particle_radius)
      .def_rw("strict", &Parameters::strict)
      .def_rw("image", &Parameters::image)
      .def_rw("mesh", &Parameters::mesh)
      .def_rw("motion", &Parameters::motion)
      .def_rw("layers", &Parameters::layers)
      .def("set", &set_parameter, "name"_a, "value"_a)
      .def("set_method",
           [](Parameters& p, const std::string& name) { p.method = method_named(name); })
      .def("set_maps", [](Parameters& p, const std::string& list) { p.aovs = aovs_named(list); })
      .def("describe", [](const Parameters& p) { return describe(p); });
  module.def("named_parameters", [] {
    nb::list all;
    for (const NamedParameter& one : named_parameters()) {
      nb::dict entry;
      entry["name"] = one.name;
      entry["group"] = one.group;
      entry["unit"] = one.unit;
      entry["effect"] = one.effect;
      entry["default"] = one.whole ? nb::object(nb::int_(static_cast<long>(one.value)))
                                   : nb::object(nb::float_(one.value));
      entry["least"] = one.least;
      entry["most"] = one.most;
      all.append(entry);
    }
    return nb::typed<nb::list, Named>(all);
  });
  module.def("methods", [] {
    nb::dict all;
    for (const MethodEntry& entry : method_list()) all[entry.name.c_str()] = entry.what;
    return nb::typed<nb::dict, nb::str, nb::str>(all);
  });
}

void bind_camera(nb::module_& module) {
  nb::class_<Camera>(module, "Camera")
      .def("__init__",
           [](Camera* camera, int width, int height, const std::array<double, 16>& view,
              const std::array<double, 16>& projection) {
             new (camera) Camera{width, height, view, projection};
             check(*camera);
           })
      .def_ro("width", &Camera::width)
      .def_ro("height", &Camera::height)
      .def_ro("view", &Camera::view)
      .def_ro("projection", &Camera::projection);
  module.def("look_at", &look_at);
  module.def("frame_camera", [](const Frame& frame, const std::array<double, 3>& up, double fov,
                                int width, int height) {
    const nb::gil_scoped_release released;
    return frame_particles(*frame.source, {up, fov, width, height});
  });
  module.def("read_camera", &read_camera);
}

void bind_particles(nb::module_& module) {
  nb::class_<Frame> frame(module, "Frame");
  frame.def_prop_ro("size", [](const Frame& f) { return f.source->size(); })
      .def_prop_ro("particle_radius", [](const Frame& f) { return f.source->particle_radius(); })
      .def_prop_ro("has_velocity", [](const Frame& f) { return f.source->has_velocity(); })
      .def_prop_ro("has_radius", [](const Frame& f) { return f.source->has_radius(); })
      .def_prop_ro("time", [](const Frame& f) { return f.own ? f.own->time : 0; });
  const auto column_of = [&](const char* name, std::vector<float> Particles::*values) {
    frame.def_prop_ro(name, [values](nb::handle self) -> std::optional<Array<float>> {
      Frame& f = nb::cast<Frame&>(self);
      if (!f.own) return {};
      return shared(self, (*f.own).*values);
    });
  };
  column_of("x", &Particles::x);
  column_of("y", &Particles::y);
  column_of("z", &Particles::z);
  column_of("vx", &Particles::vx);
  column_of("vy", &Particles::vy);
  column_of("vz", &Particles::vz);
  column_of("density", &Particles::density);
  column_of("radius", &Particles::radius);
  frame.def_prop_ro("id", [](nb::handle self) -> std::optional<Array<std::int64_t>> {
    Frame& f = nb::cast<Frame&>(self);
    if (!f.own || f.own->id.empty()) return {};
    return Array<std::int64_t>(f.own->id.data(), {f.own->id.size()}, self);
  });
  frame.def_prop_ro("attribute_names", [](const Frame& f) { return f.source->attributes(); });
  frame.def_prop_ro("attributes", [](nb::handle self) {
    Frame& f = nb::cast<Frame&>(self);
    return f.own ? dict_of(self, f.own->attributes, {f.own->size()}) : Arrays(nb::dict());
  });
  module.def(
      "borrow",
      [](const Place& points, const std::optional<Place>& velocities,
         const std::optional<Place>& radii, double particle_radius,
         const std::vector<NamedPlace>& attributes) {
        return Frame{nullptr,
                     source_of(borrow(points, velocities, radii, particle_radius, attributes))};
      },
      "points"_a, "velocities"_a.none(), "radii"_a.none(), "particle_radius"_a, "attributes"_a);
  module.def(
      "read_particles",
      [](const std::string& path, double particle_radius,
         const std::vector<std::string>& attributes, const std::string& dataset,
         std::int64_t timestep) {
        const nb::gil_scoped_release released;
        Frame read;
        read.own = std::make_unique<Particles>(
            read_particles(path, reading(particle_radius, attributes, dataset, timestep)));
        read.source = source_of(*read.own);
        return read;
      },
      "path"_a, "particle_radius"_a, "attributes"_a, "dataset"_a, "timestep"_a);
  module.def(
      "open_particles",
      [](const std::string& path, double particle_radius,
         const std::vector<std::string>& attributes, const std::string& dataset,
         std::int64_t timestep) {
        const nb::gil_scoped_release released;
        return Frame{nullptr,
                     open_particles(path, reading(particle_radius, attributes, dataset, timestep))};
      },
      "path"_a, "particle_radius"_a, "attributes"_a, "dataset"_a, "timestep"_a);
}

void bind_devices(nb::module_& module) {
  nb::class_<Session>(module, "Device")
      .def(nb::init<const std::string&>(), nb::call_guard<nb::gil_scoped_release>())
      .def_prop_ro("info", [](const Session& session) { return info_of(session.device()); })
      .def("cancel", &Session::cancel);
  module.def("devices", [] {
    nb::list all;
    for (const DeviceInfo& info : list_devices()) all.append(info_of(info));
    return nb::typed<nb::list, Named>(all);
  });
  module.def("extract", &extract_frame, "device"_a, "frame"_a, "camera"_a, "parameters"_a,
             "memory"_a, "timed"_a, "progress"_a.none(), "on_notice"_a.none());
  module.def("draw_whitewater", &add_whitewater, "device"_a, "surface"_a, "frames"_a, "memory"_a,
             "timed"_a, "progress"_a.none(), "on_notice"_a.none());
  module.def("extract_closed", &close_frame, "device"_a, "frame"_a, "cell"_a, "adaptive"_a,
             "memory"_a, "parameters"_a, "progress"_a.none(), "on_notice"_a.none());
  module.attr("STREAM_MEMORY") = kStreamMemory;
}

}  // namespace
}  // namespace meniscus::python

NB_MODULE(_core, module) {
  using namespace meniscus::python;
  module.def("version", &meniscus::version);
  nb::register_exception_translator(translate, nullptr);
  bind_parameters(module);
  bind_camera(module);
  bind_particles(module);
  bind_surface(module);
  bind_devices(module);
}
