// Everything a user can set. Lengths are in particle radii (the particle spacing is two radii)
// unless the comment says otherwise; defaults are the design's.
#pragma once

#include <string>
#include <vector>

#include "meniscus/export.hpp"

namespace meniscus MENISCUS_API {

/// How the surface is made from the visible particles.
enum class Method {
  fit,             // a quadric around every particle of the surface, two-sheet blend: the default
  stable,          // a fit around each visible particle alone, as in the paper
  paper,           // the paper as printed, to reproduce its figures
  ssm,             // Screen Space Meshes (Mueller et al. 2007), the paper's baseline
  spheres,         // the particles as spheres
  bilateral,       // bilateral filter on the spheres' depth
  narrow_range,    // Truong and Yuksel 2018
  curvature_flow,  // van der Laan, Green and Sainz 2009
  anisotropic,     // anisotropic kernels, Yu and Turk 2013
  groups,          // as fit, but a quadric around each group of merged particles
};

/// Which particles are seen (paper 2.1).
struct VisibleParams {
  double footprint = 1.8;  // radius of the sphere that hides what lies behind it
  double owned = 0.04;     // share of its own footprint that a visible particle must own
};

/// Loose particles, drawn by a density field instead of fits (paper, end of 3).
struct SplashParams {
  double link = 3.2;  // particles nearer than this are connected
  int pieces = 6;     // a connected component of at most this many particles is splash
};

/// Delaunay on the screen and ghost triangles (paper 2.2).
struct TriangleParams {
  double max_edge = 5.2;  // longest edge on the screen
  double d_max = 6;       // largest depth range of a triangle; beyond it is a ghost
};

/// Normals of the triangles and groups of similar normal (paper 2.2).
struct MergeParams {
  double cosine = 0.95;  // method paper: groups merge when their normals' product exceeds this
  double distance = 0;   // method paper: and only where their centres are nearer; 0: however far
  int smoothing_rounds = 4;  // methods fit, groups, stable: smoothing of the triangle normals
  double reach = 5.8;        // method groups: radius of a group where the surface is calm
  double least_reach = 3.6;  // ... and where it bends or breaks
};

/// The weighted fit around each particle (paper 2.3, Eq. 2).
struct FitParams {
  double support = 10;         // radius of a fit's support
  double round_support = 7;    // the same, at most, where one quadric goes round a bend
  double least_support = .55;  // share of it that is left where one quadric cannot follow
  double normal_sigma = .45;   // normal difference that a fit crosses, unitless
  int passes = 3;              // fits of each particle, the later ones with robust weights
  double off_surface = 1.4;    // distance of the off-surface points
  double ridge = 1e-3;         // on the quadratic terms, times the sum of weights
  double tau = 0.3;            // one-sided robust scale: points this far behind lose their weight
  double offset = 1;           // the surface lies this far outside the particle centres
};

/// Where there is surface (paper 2.4.1).
struct RegionParams {
  double reference = 2.6;         // radius of the footprint whose front is the reference depth
  double contour_density = 0.14;  // the surface ends where the particle density falls below this
  double blob_density = 0.229;    // level of the density field that draws splash
  double interpolation = 0.24;    // samples between others whose points lie this near each other's
                                  // planes are interpolated where these agree about their depth;
                                  // 0: every sample is evaluated
  double sigma_s = 2;             // method paper: Eq. 4, cells
  double sigma_n = 0.3;           // method paper: Eq. 5, unitless
};

/// The intersection and the blend of the groups a ray meets (paper 2.4.2, Eqs. 6 and 7).
struct BlendParams {
  double radius = 5;       // of a fit's weight, which ends at .84 of it
  double reach = 3;        // method paper: a billboard reaches this far beyond its group's radius
  double d_max = 6;        // intersections farther than this from the reference depth do not count
  double same_low = 0.7;   // normals whose dot product is below this are another sheet
  double same_high = 0.9;  // ... and above this the same sheet
  double crease = 5;       // largest distance of two sheets that meet in a crease
};

/// Choices of method paper where the paper's text leaves them open (docs/method.md).
struct PaperParams {
  double offset = 0;      // the surface lies this far outside the particle centres
  double b_least = 0.15;  // b of Eq. 7 over the group's radius where normals are at right angles
  double b_gain = 0.45;   // what it gains up to equal normals
};

/// Screen Space Meshes; also the mesh of every method (paper 2.5).
struct MeshParams {
  double cell = 2;            // h, pixels
  int silhouette_rounds = 3;  // smoothing of the silhouette's vertices
  double z_max = 3.6;         // depth jump that makes a silhouette
};

/// Depth of the baseline (Mueller et al. 2007).
struct SsmParams {
  double footprint = 1.43;  // radius of the spheres
  double z_max = 4.5;       // depth difference that smoothing and mesh do not cross
  double sigma = 1.5;       // standard deviation of the binomial filter
  int filter = 0;           // its half width in nodes, as printed; 0: from sigma, by perspective
};

/// The particles as they are.
struct SphereParams {
  double footprint = 1.5;  // radius of the spheres
};

/// Bilateral filter on the depth map of the spheres (Green 2010).
struct BilateralParams {
  double footprint = 1.42;  // radius of the spheres
  double sigma = 1.4;       // of the Gaussian on the screen
  double range = 15;        // of the one over the difference in depth
  int iterations = 1;       // how often it is applied
  int separable = 0;        // 1: rows, then columns; 0: in two dimensions
};

/// Narrow-range filter on the depth map of the spheres (Truong and Yuksel 2018).
struct NarrowRangeParams {
  double footprint = 1.43;  // radius of the spheres
  double sigma = 1.45;      // of the Gaussian on the screen
  double delta = 3;         // samples this much nearer do not count, as much farther are clamped
  double mu = 0;            // clamped samples count as this much behind the centre
  int iterations = 1;       // how often it is applied
  int separable = 0;        // 1: rows, then columns; 0: in two dimensions
  int cleanup = 2;          // half width of the last pass, samples
};

/// Screen-space mean curvature flow (van der Laan et al. 2009).
struct CurvatureFlowParams {
  double footprint = 1.42;  // radius of the spheres
  double time = 2.2;        // of the flow, radii^2
  double step = 0.5;        // of the longest stable step
  double z_max = 4.5;       // a depth jump that is a silhouette
};

/// Level set of anisotropic kernels (Yu and Turk 2013).
struct AnisotropicParams {
  double h = 2;         // smoothing length; neighbours lie within 2 h
  double lambda = 0.9;  // how far centres move to their neighbours' mean
  double k_r = 4;       // largest ratio of a kernel's axes
  double k_s = 2;       // size of the kernels; 1: h in a full neighbourhood
  double k_n = 0.5;     // size of the kernels with few neighbours
  int n_eps = 6;        // up to this many neighbours are few
  double level = 0.33;  // of the field at the surface
};

/// How foam, spray and bubbles are drawn (whitewater.hpp).
struct WhitewaterParams {
  double radius = 0;     // of their discs, world units; 0: the particles' own
  double tolerance = 1;  // foam and spray are seen up to so far behind the surface, bubbles from so
                         // far before it on
};

/// Which maps a surface has beside depth (arbitrary output variables); see Surface.
struct Aovs {
  bool normal = true, position = true, group = true, kind = true, residual = true;
  bool velocity = true;  // where Parameters::motion asks for motion
};

/// Bodies of fluid along a ray that Parameters::layers can ask for, at most.
inline constexpr int kMostLayers = 8;

/// All parameters of extract(). Messages call a number by its name on the command line:
/// fit.support is --support (`meniscus extract --help` has the list, with ranges).
struct Parameters {
  Method method = Method::fit;
  double particle_radius = 0;  // world units; 0: the file's, else estimated
  bool strict = false;         // NaN and infinite coordinates and velocities are an error, and for
                               // closed meshes particles that lie farther out than cells reach
  bool image = true;           // make the maps
  Aovs aovs;                   // which maps beside depth
  bool mesh = true;            // make the mesh
  bool motion = true;          // make velocities where the particles carry them
  int layers = 0;              // where `image`: bodies of fluid along a pixel's ray that are kept,
                               // 1 to kMostLayers; 0: the front alone. Methods fit, groups, stable
  double thin = 4;             // pixels between particles; large frames whose particles lie closer
                               // than half of it are thinned to it. 0: never
  double fairing = 1.2;        // how far normals are smoothed along a sheet, the sigma of a
                         // Gaussian, particle radii; 0: not at all. Methods fit, groups, stable
  double disorder = -1;  // how irregularly the particles lie, from 0, as SPH leaves them, over 1,
                         // one anywhere in each cube of a lattice, to 2, anywhere, as FLIP and MPM
                         // leave them: above 0 particles are relaxed, and supports of fits are
                         // wider. -1: measured. Methods fit, groups, stable
  VisibleParams visible;
  SplashParams splash;
  TriangleParams triangle;
  MergeParams merge;
  FitParams fit;
  RegionParams region;
  BlendParams blend;
  PaperParams paper;
  MeshParams grid;
  SsmParams ssm;
  SphereParams spheres;
  BilateralParams bilateral;
  NarrowRangeParams narrow_range;
  CurvatureFlowParams curvature_flow;
  AnisotropicParams anisotropic;
  WhitewaterParams whitewater;
};

/// The maps of a list of names, e.g. "N,id": those of their channels in EXR files. Throws
/// InvalidArgument, with the names there are.
Aovs aovs_named(const std::string& list);

/// The list of the maps that are made, as aovs_named() takes it.
std::string to_string(const Aovs& aovs);

/// A method's name on the command line, what it is in one line, and what it can do.
struct MethodEntry {
  Method method;
  std::string name;
  std::string what;
  bool layers = false;   // finds the bodies of fluid behind the front (Parameters::layers)
  bool spheres = false;  // draws every particle as a sphere, and so in its own size
};

/// Every method once, the default first: the one list behind --method, its help and the studies.
const std::vector<MethodEntry>& method_list();

/// The method's name in method_list().
std::string to_string(Method method);

/// Whether the method finds the bodies of fluid behind the front: fit, groups and stable do.
bool has_layers(Method method);

/// Whether the method draws every particle as a sphere, whose radius may be the particle's own.
bool draws_spheres(Method method);

/// The method of that name. Throws InvalidArgument, with the names there are.
Method method_named(const std::string& name);

/// Parameters as "name=value" lines in a fixed order: what the EXR header carries. Without the
/// particle radius, which the surface has, and without what outputs show: image, mesh and motion;
/// `strict` changes no result; maps and layers only where they are not the default.
std::string describe(const Parameters& parameters);

/// Throws InvalidArgument, naming the parameter, its value and its range; also for a method that
/// method_list() lacks.
void check(const Parameters& parameters);

}  // namespace MENISCUS_API
