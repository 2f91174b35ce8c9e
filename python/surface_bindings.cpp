// Surfaces: their maps and mesh as arrays that share their memory, and files of them.
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/unique_ptr.h>
#include <nanobind/stl/vector.h>

#include <cmath>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>

#include "bindings.hpp"
#include "meniscus/whitewater.hpp"

namespace nb = nanobind;

namespace meniscus::python {
namespace {

// [height, width] or [height, width, components], as it lies in `values`; None where it is empty.
// The array keeps `owner` alive.
template <class Number, class T>
std::optional<Array<Number>> map_of(nb::handle owner, std::vector<T>& values) {
  constexpr std::size_t components = sizeof(T) / sizeof(Number);
  if (values.empty()) return {};
  const Camera& camera = nb::cast<Made&>(owner).surface.camera;
  const std::size_t shape[] = {static_cast<std::size_t>(camera.height),
                               static_cast<std::size_t>(camera.width), components};
  return Array<Number>(values.data(), components == 1 ? 2 : 3, shape, owner);
}

// [n, 3], without values, too.
template <class Number, class T>
Array<Number> rows_of(nb::handle owner, std::vector<T>& values) {
  const std::size_t shape[] = {values.size(), sizeof(T) / sizeof(Number)};
  return Array<Number>(values.data(), 2, shape, owner);
}

// The same of the layers.
template <class Number, class T>
void bind_layer_map(nb::class_<Made>& surface, const char* name, std::vector<T> Layers::*map) {
  surface.def_prop_ro(name, [map](nb::handle self) {
    return map_of<Number>(self, nb::cast<Made&>(self).surface.layers.*map);
  });
}

// [most, height, width] of the layers; None without them.
void bind_depths(nb::class_<Made>& surface, const char* name, std::vector<float> Layers::*depths) {
  surface.def_prop_ro(name, [depths](nb::handle self) -> std::optional<Array<float>> {
    Surface& made = nb::cast<Made&>(self).surface;
    if (made.layers.most == 0) return {};
    const std::size_t shape[] = {static_cast<std::size_t>(made.layers.most),
                                 static_cast<std::size_t>(made.camera.height),
                                 static_cast<std::size_t>(made.camera.width)};
    return Array<float>((made.layers.*depths).data(), 3, shape, self);
  });
}

template <auto Map, class Number>
void bind_map(nb::class_<Made>& surface, const char* name) {
  surface.def_prop_ro(name, [](nb::handle self) {
    return map_of<Number>(self, nb::cast<Made&>(self).surface.*Map);
  });
}

Compression compression_named(const std::string& name) {
  const std::map<std::string, Compression> all{
      {"none", Compression::none}, {"rle", Compression::rle}, {"zips", Compression::zips},
      {"zip", Compression::zip},   {"piz", Compression::piz}, {"pxr24", Compression::pxr24}};
  const auto found = all.find(name);
  require(found != all.end(),
          "compression is " + name + ", must be one of none, rle, zips, zip, piz, pxr24");
  return found->second;
}

Preview preview_named(const std::string& name) {
  const std::map<std::string, Preview> all{{"lit", Preview::lit},
                                           {"normal", Preview::normal},
                                           {"depth", Preview::depth},
                                           {"groups", Preview::groups},
                                           {"glass", Preview::glass}};
  const auto found = all.find(name);
  require(found != all.end(),
          "preview is " + name + ", must be one of lit, normal, depth, groups, glass");
  return found->second;
}

}  // namespace

nb::object notice_of(const Notice& notice) {
  const auto number = [](double value) -> nb::object {
    return std::isnan(value) ? nb::none() : nb::object(nb::float_(value));
  };
  return nb::module_::import_("meniscus._errors")
      .attr("Notice")(to_string(notice.code), to_string(notice), notice.subject,
                      notice.place < 0 ? nb::none() : nb::object(nb::int_(notice.place)),
                      notice.count, notice.of, number(notice.found), number(notice.wanted));
}

void bind_surface(nb::module_& module) {
  nb::class_<Made> surface(module, "Surface");
  bind_map<&Surface::depth, float>(surface, "depth");
  bind_map<&Surface::normal, float>(surface, "normal");
  bind_map<&Surface::position, float>(surface, "position");
  bind_map<&Surface::group, std::uint32_t>(surface, "group");
  bind_map<&Surface::kind, std::uint8_t>(surface, "kind");
  bind_map<&Surface::residual, float>(surface, "residual");
  bind_map<&Surface::velocity, float>(surface, "velocity");
  bind_layer_map<std::uint32_t>(surface, "layers", &Layers::count);
  bind_layer_map<float>(surface, "thickness", &Layers::thickness);
  bind_layer_map<float>(surface, "back_normal", &Layers::back_normal);
  bind_depths(surface, "entry", &Layers::entry);
  bind_depths(surface, "exit", &Layers::exit);
  surface
      .def_prop_ro("forward",
                   [](nb::handle self) {
                     return map_of<float>(self, nb::cast<Made&>(self).surface.forward.pixels);
                   })
      .def_prop_ro("mesh_positions",
                   [](nb::handle self) {
                     return rows_of<float>(self, nb::cast<Made&>(self).surface.mesh.position);
                   })
      .def_prop_ro("mesh_normals",
                   [](nb::handle self) {
                     return rows_of<float>(self, nb::cast<Made&>(self).surface.mesh.normal);
                   })
      .def_prop_ro("mesh_velocities",
                   [](nb::handle self) -> std::optional<Array<float>> {
                     Mesh& mesh = nb::cast<Made&>(self).surface.mesh;
                     if (mesh.velocity.empty()) return {};
                     return rows_of<float>(self, mesh.velocity);
                   })
      .def_prop_ro("mesh_triangles",
                   [](nb::handle self) {
                     return rows_of<std::uint32_t>(self,
                                                   nb::cast<Made&>(self).surface.mesh.triangle);
                   })
      .def_prop_ro("attributes",
                   [](nb::handle self) {
                     Surface& made = nb::cast<Made&>(self).surface;
                     return dict_of(self, made.attributes,
                                    {static_cast<std::size_t>(made.camera.height),
                                     static_cast<std::size_t>(made.camera.width)});
                   })
      .def_prop_ro("mesh_attributes",
                   [](nb::handle self) {
                     Mesh& mesh = nb::cast<Made&>(self).surface.mesh;
                     return dict_of(self, mesh.attributes, {mesh.position.size()});
                   })
      .def_prop_ro("whitewater",
                   [](nb::handle self) {
                     using Maps = nb::typed<nb::dict, nb::str, nb::any>;
                     nb::dict types;
                     for (WhitewaterMaps& maps : nb::cast<Made&>(self).surface.whitewater) {
                       nb::dict all;
                       all["coverage"] = map_of<float>(self, maps.coverage);
                       all["density"] = map_of<float>(self, maps.density);
                       all["depth"] = map_of<float>(self, maps.depth);
                       all["velocity"] = map_of<float>(self, maps.velocity);
                       all["behind"] = map_of<float>(self, maps.behind);
                       types[to_string(maps.type).c_str()] = all;
                     }
                     return nb::typed<nb::dict, nb::str, Maps>(types);
                   })
      .def_prop_ro("camera", [](const Made& made) { return made.surface.camera; })
      .def_prop_ro("particle_radius", [](const Made& made) { return made.surface.particle_radius; })
      .def_prop_ro("disorder", [](const Made& made) { return made.surface.disorder; })
      .def_prop_ro("counts", [](const Made& made) { return named(made.surface.counts); })
      .def_prop_ro("notices",
                   [](const Made& made) {
                     nb::list all;
                     for (const Notice& notice : made.surface.notices)
                       all.append(notice_of(notice));
                     return nb::typed<nb::list, nb::any>(all);
                   })
      .def_prop_ro("parameters", [](const Made& made) { return describe(made.parameters); })
      .def_prop_ro("timings",
                   [](const Made& made) {
                     std::vector<std::tuple<std::string, double, double>> all;
                     for (const StageTime& time : made.timings)
                       all.emplace_back(time.stage, time.host_ms, time.device_ms);
                     return all;
                   })
      .def("set_forward",
           [](Made& made, const Camera& next, double frames_per_second) {
             made.surface.forward = screen_motion(made.surface, next, frames_per_second);
           })
      .def(
          "write_exr",
          [](const Made& made, const std::string& path, const std::string& compression, bool half) {
            const Compression how = compression_named(compression);
            const nb::gil_scoped_release released;
            write_exr(path, made.surface, made.parameters, how, half);
          })
      .def("write_deep_exr",
           [](const Made& made, const std::string& path) {
             const nb::gil_scoped_release released;
             write_deep_exr(path, made.surface, made.parameters);
           })
      .def("write_mesh",
           [](const Made& made, const std::string& path) {
             const nb::gil_scoped_release released;
             write_mesh(path, made.surface.mesh);
           })
      .def("write_png", [](const Made& made, const std::string& path, const std::string& preview) {
        const Preview which = preview_named(preview);
        const nb::gil_scoped_release released;
        write_png(path, made.surface, which);
      });
  module.def("read_exr", [](const std::string& path) {
    const nb::gil_scoped_release released;
    auto made = std::make_unique<Made>();
    made->surface = read_exr(path);
    return made;
  });
}

}  // namespace meniscus::python
