#include "engine/reference/path.h"

#include <algorithm>
#include <cmath>
#include <glm/gtc/quaternion.hpp>

namespace halflight::reference {
namespace {

/// Samples the aperture of a lens by rejection from a square, in the plane of the camera's x and y axes, world units.
dvec2 point_on_lens(const Lens& lens, double focal_length, Random& random) {
    const double diameter = lens.aperture > 0 ? lens.aperture / 1000 : focal_length / lens.fstop;
    for (;;) {
        const dvec2 p(2 * random.uniform() - 1, 2 * random.uniform() - 1);
        if (glm::length(p) > 1) continue;
        // A polygon is the intersection of the half-planes of its edges. The first edge faces `rotation`.
        bool inside = true;
        for (int blade = 0; blade < lens.blades; ++blade) {
            const double angle = glm::radians(lens.rotation) + 2 * kPi * blade / lens.blades;
            inside = inside && dot(p, dvec2(std::cos(angle), std::sin(angle))) <= std::cos(kPi / lens.blades);
        }
        if (inside) return diameter / 2 * p;
    }
}

/// The picture of one eye.
struct EyePicture {
    dvec2 corner{0};  // upper left corner, pixels
    dvec2 size{0};    // pixels
    double side = 0;  // place of the eye to the right of the camera, world units
};

/// Returns the picture of the eye that a pixel shows.
EyePicture eye_picture(const ReferenceSettings& settings, int x, int y) {
    const Optics& optics = settings.camera.optics;
    EyePicture picture{.size = {settings.width, settings.height}};
    bool right = optics.stereo == Stereo::right;
    if (optics.stereo != Stereo::none && optics.stereo != Stereo::left && !right) {
        const int axis = optics.stereo == Stereo::side_by_side ? 0 : 1;
        picture.size[axis] /= 2;
        right = (axis == 1 ? y : x) >= picture.size[axis];
        if (right) picture.corner[axis] = picture.size[axis];
    }
    if (optics.stereo != Stereo::none) picture.side = (right ? 1 : -1) * optics.eye_distance / 2;
    return picture;
}

/// Sets the direction that a panorama or a fisheye sees at a place of its picture, from its upper left corner, (0,0) to
/// (1,1), and the axis along which the eyes lie. Returns false outside of the image circle.
bool see(const Optics& optics, const dvec2& place, const dvec2& size, dvec3& direction, dvec3& side) {
    if (optics.projection == Projection::panorama) {
        const glm::dquat turn = glm::angleAxis((0.5 - place.x) * 2 * kPi, dvec3(0, 1, 0));
        direction = turn * (glm::angleAxis((0.5 - place.y) * kPi, dvec3(1, 0, 0)) * dvec3(0, 0, -1));
        side = turn * dvec3(1, 0, 0);
        return true;
    }
    const dvec2 from_centre = (place - 0.5) * size / std::min(size.x, size.y) * 2.0;  // length 1 on the image circle
    const double r = std::hypot(from_centre.x, from_centre.y), half_fov = glm::radians(optics.fisheye_fov) / 2;
    const double angle = optics.projection == Projection::fisheye
                             ? r * half_fov
                             : 2 * std::asin(std::min(r * std::sin(half_fov / 2), 1.0));
    // The camera's forward axis is turned towards the place in the picture, about an axis at right angles to both.
    const dvec3 across(from_centre.y, from_centre.x, 0);
    direction = dvec3(0, 0, -1);
    if (r > 0) direction = glm::angleAxis(-angle, across / r) * direction;
    side = dvec3(1, 0, 0);
    return r <= 1;
}

/// Returns the ray through point (px, py) of the image, pixels from its top left corner, relative to Tracer::origin().
/// It starts at a point of the lens if there are random numbers, and otherwise at its centre. pixel: that of the
/// point. Returns a ray that ends before it starts if the camera sees nothing.
ReferenceRay camera_ray(const Prepared& scene, const ReferenceSettings& settings, const ivec2& pixel, double px,
                        double py, Random* random = nullptr) {
    const Camera& camera = settings.camera;
    const EyePicture eye = eye_picture(settings, pixel.x, pixel.y);
    const dvec2 place = (dvec2(px, py) - eye.corner) / eye.size;
    const double aspect = eye.size.x / eye.size.y;
    const double half = camera.orthographic ? camera.ortho_height / 2 : std::tan(camera.vertical_fov / 2);
    const double x = (2 * place.x - 1) * half * aspect;
    const double y = (1 - 2 * place.y) * half;
    dvec3 from = camera.orthographic ? dvec3(x, y, 0) : dvec3(0);
    dvec3 along = camera.orthographic ? dvec3(0, 0, -1) : dvec3(x, y, -1);  // t is depth along -Z
    dvec3 side(1, 0, 0);
    bool seen = true;
    if (camera.optics.projection != Projection::camera) seen = see(camera.optics, place, eye.size, along, side);
    if (eye.side != 0) {
        // The lines of sight of both eyes meet at the distance of convergence, like rays of a lens at its focus.
        from += eye.side * side;
        if (camera.optics.convergence > 0) along -= eye.side * side / camera.optics.convergence;
    }
    const Lens& lens = camera.lens;
    if (random && lens.focus.kind == Focus::Kind::distance && (lens.fstop > 0 || lens.aperture > 0)) {
        const double sensor = lens.sensor > 0 ? lens.sensor / 1000 : 0.036;
        const double focal_length = sensor / (2 * half * std::max(aspect, 1.0));
        const dvec3 start(point_on_lens(lens, focal_length, *random), 0);
        // The ray from the centre of the lens meets the ray from `start` at the distance of the focus.
        from += start;
        along -= start / lens.focus.distance;
    }

    ReferenceRay ray;
    const dmat4& m = camera.camera_to_world;
    ray.origin = dvec3(m[3]) - scene.tracer.origin() + dmat3(m) * from;
    ray.direction = dmat3(m) * along;
    ray.t_min = camera.near_plane;
    if (camera.far_plane > 0) ray.t_max = camera.far_plane;
    if (!seen) ray.t_max = -1;
    ray.passes_backs = settings.backfaces != Backfaces::show;
    return ray;
}

/// Samples one axis of a point of the pixel filter, pixels from the pixel's centre. The Blackman-Harris window is
/// sampled by rejection (von Neumann 1951), which needs its values only.
double filtered(const PixelFilter& filter, Random& random) {
    for (;;) {
        const double t = 2 * random.uniform() - 1, c = std::cos(kPi * t);
        const double window = 0.35875 + 0.48829 * c + 0.14128 * (2 * c * c - 1) + 0.01168 * c * (4 * c * c - 3);
        if (filter.shape == PixelFilter::Shape::box || random.uniform() < window) return filter.radius * t;
    }
}

/// Returns the weight of the strategy with density `a` (Veach 1997, eq. 9.13, beta = 2).
double power_heuristic(double a, double b) {
    if (!(a > 0)) return 0;
    const double r = b / a;
    return 1 / (1 + r * r);
}

double max_component(const dvec3& v) {
    return std::max({v.x, v.y, v.z});
}

/// The solids that a ray passes straight on, with the absorption on its way.
class SolidPanes {
  public:
    explicit SolidPanes(const Medium& origin) : began_inside_(origin.thickness > 0) {}

    bool has_entered() const { return !entered_.empty(); }
    /// Returns whether the ray meets the surface like any other: it leaves a solid that it began in.
    bool bends_at(const BsdfParameters& p) const { return p.is_solid() && !p.front && !has_entered() && began_inside_; }
    /// Takes the ray through a surface at a distance. Returns the transmittance of the way from the last one.
    dvec3 pass(const BsdfParameters& p, double distance) {
        dvec3 share(1);
        for (const Medium& m : entered_) share *= m.transmittance(distance - from_);
        from_ = distance;
        if (!p.is_solid()) return share;
        if (p.front) {
            entered_.push_back(p.inside);
        } else if (has_entered()) {
            const auto same = [&](const Medium& m) { return m.absorption == p.inside.absorption; };
            const auto left = std::find_if(entered_.rbegin(), entered_.rend(), same);
            entered_.erase(left == entered_.rend() ? std::prev(entered_.end()) : std::prev(left.base()));
        } else {  // an open surface, from inside
            share *= p.inside.transmittance(p.inside.thickness);
        }
        return share;
    }
    /// Returns the transmittance from the last surface to the end of the ray. The way inside of an open surface is at
    /// most its thickness.
    dvec3 to_end(double distance) const {
        dvec3 share(1);
        dvec3 depth(0), endless(0);
        for (const Medium& m : entered_) depth += m.absorption, endless += m.absorption * m.thickness;
        const double way = distance - from_;
        for (int k = 0; k < 3; ++k) share[k] = std::exp(-(depth[k] > 0 ? std::min(depth[k] * way, endless[k]) : 0));
        return share;
    }

  private:
    bool began_inside_;
    std::vector<Medium> entered_;
    double from_ = 0;
};

/// State of a path at its current surface.
class Path {
  public:
    Path(const Prepared& scene, const ReferenceSettings& settings, Random& random)
        : scene_(scene), settings_(settings), random_(random) {}

    PathResult trace(const ReferenceRay& ray);

  private:
    void add(Component component, const dvec3& value) {
        const auto way = static_cast<std::size_t>(bounce_ == 1 ? component : first_);
        (bounce_ == 1 ? result_.radiance.direct : result_.radiance.indirect)[way] += value;
    }
    void sample_light(const Surface& surface, const Bsdf& bsdf);
    void arrive(Surface& surface, double distance);
    dvec3 share_that_arrives(const Surface& surface, const Medium& medium, const LightSample& light);
    bool follow(ReferenceRay ray, Surface& surface, const Bsdf::Sample& sample);
    void add_lamps(const dvec3& from, const Bsdf::Sample& sample, const SolidPanes& solids, double begin, double end);
    void add_shown_lamps(const ReferenceRay& ray, double end);
    double surface_weight(const Bsdf::Sample& sample, double light_pdf, const LightLinks& links) const;
    bool lit_by(const LightLinks& links) const;
    AlphaTest alpha() { return {random_.bits()}; }

    const Prepared& scene_;
    const ReferenceSettings& settings_;
    Random& random_;
    PathResult result_;
    dvec3 throughput_{1};
    int channel_ = 1;                       // colour channel of solids that disperse light
    bool one_channel_ = false;              // the path has met such a solid
    bool sees_ = true;                      // all scattering so far was at perfect mirrors and clear glass
    bool met_pane_ = false;                 // the path has met a pane that it might have passed
    Medium medium_;                         // medium of the current ray, then that on wo's side
    int bounce_ = 0;                        // number of reflections, including the next one
    Component first_ = Component::diffuse;  // lobe by which the path left its first surface
    int receiver_ = kNone;                  // instance of the last surface that is no pane
};

/// Returns the share of a light sample that arrives: 0 if something opaque is in between, 1 if nothing is.
dvec3 Path::share_that_arrives(const Surface& surface, const Medium& medium, const LightSample& light) {
    ReferenceRay ray;
    ray.origin = surface.leave(light.wi);
    ray.classes = light.links.blockers;
    ray.passes_backs = settings_.backfaces == Backfaces::cull;
    if (light.infinite) {
        ray.direction = light.wi;
    } else {
        ray.direction = light.end - ray.origin;
        ray.t_max = 1;
    }
    dvec3 share(1);
    SolidPanes solids(medium);
    const dvec3 from = ray.origin;
    const double length = light.infinite ? std::numeric_limits<double>::infinity() : distance(light.end, from);
    while (const std::optional<ReferenceHit> hit = scene_.tracer.closest_hit(ray, alpha())) {
        const Surface pane = make_surface(scene_.tracer, *hit, -normalize(ray.direction));
        if (pane.unlit || solids.bends_at(pane.parameters)) return dvec3(0);
        share *= Bsdf(pane.parameters, pane.wo, pane.n_g, pane.n, pane.n_k).straight();
        if (share == dvec3(0)) break;
        share *= solids.pass(pane.parameters, distance(pane.position, from));
        const dvec3 left = ray.origin + ray.direction;
        ray.origin = pane.leave(ray.direction);
        if (!light.infinite) ray.direction = left - ray.origin;
    }
    return share * solids.to_end(length);
}

/// Adds the lights with a size that a ray meets between two distances.
void Path::add_lamps(const dvec3& from, const Bsdf::Sample& sample, const SolidPanes& solids, double begin,
                     double end) {
    for (const MetLight& light : scene_.lights.met(from, sample.wi, begin, end)) {
        const dvec3 passed = solids.to_end(light.distance) *
                             medium_.transmittance(std::isinf(light.distance) ? medium_.thickness : light.distance);
        add(first_, throughput_ * passed * light.radiance * surface_weight(sample, light.pdf, light.links));
    }
}

/// Traces a sampled ray from a surface to the next one, through panes by chance. Returns false if it meets nothing.
bool Path::follow(ReferenceRay ray, Surface& surface, const Bsdf::Sample& sample) {
    met_pane_ = false;
    const dvec3 from = surface.position;
    SolidPanes solids(medium_);
    double way = 0;  // length from the surface to the last pane
    while (const std::optional<ReferenceHit> hit = scene_.tracer.closest_hit(ray, alpha())) {
        add_lamps(from, sample, solids, way, way + hit->t);
        surface = make_surface(scene_.tracer, *hit, -ray.direction);
        const Bsdf bsdf(surface.parameters, surface.wo, surface.n_g, surface.n, surface.n_k);
        const BsdfParameters& p = surface.parameters;
        const bool bent = p.is_solid() && (sample.mirror || solids.bends_at(p));
        const dvec3 share = surface.unlit || bent ? dvec3(0) : bsdf.straight();
        // Rays that have entered a solid pass its other side, too.
        const double probability =
            max_component(share) > 0 && p.is_solid() && !p.front && solids.has_entered() ? 1 : max_component(share);
        const bool passes = probability > 0 && random_.uniform() < probability;
        if (!passes) {
            met_pane_ = probability > 0;
            throughput_ *= solids.to_end(way + hit->t);
            surface.emitted *= throughput_;
            arrive(surface, way + hit->t);
            surface.emitted /= 1 - probability;
            throughput_ /= 1 - probability;
            return true;
        }
        throughput_ *= share / probability * solids.pass(p, way + hit->t);
        way += hit->t;
        ray.origin = surface.leave(ray.direction);
    }
    add_lamps(from, sample, solids, way, std::numeric_limits<double>::infinity());
    throughput_ *= solids.to_end(std::numeric_limits<double>::infinity());
    return false;
}

void Path::sample_light(const Surface& surface, const Bsdf& bsdf) {
    const std::optional<LightSample> light = scene_.lights.sample(surface, random_);
    if (!light || !(light->pdf > 0) || light->radiance == dvec3(0) || !lit_by(light->links)) return;
    if (settings_.backfaces == Backfaces::cull && light->back) return;
    const Bsdf::Value value = bsdf.evaluate(light->wi);
    if (value.diffuse == dvec3(0) && value.glossy == dvec3(0)) return;
    const Medium medium = bsdf.medium_towards(light->wi, medium_);
    const dvec3 share = share_that_arrives(surface, medium, *light);
    if (share == dvec3(0)) return;
    const auto weight = [&](double surface_pdf) {
        const bool alone = light->punctual || light->links.blockers != LightLinks().blockers ||
                           settings_.strategy == ReferenceStrategy::lights_only;
        return alone ? 1 : power_heuristic(light->pdf, surface_pdf);
    };
    const double way = light->infinite ? medium.thickness : distance(light->end, surface.position);
    const dvec3 received = throughput_ * share * medium.transmittance(way) * light->radiance / light->pdf;
    add(Component::diffuse, received * value.diffuse * weight(value.pdf_diffuse));
    add(Component::glossy, received * value.glossy * weight(value.pdf_glossy));
}

/// Returns whether lights with these links light the surface that the path leaves.
bool Path::lit_by(const LightLinks& links) const {
    const int own = scene_.tracer.scene().instances[static_cast<std::size_t>(receiver_)].link_class;
    return ((links.receivers >> own) & 1) == 1;
}

/// Returns the MIS weight of light hit by a sampled ray, which sample_light() finds with density `light_pdf`. Objects
/// that this light passes stop sampled rays, so light samples alone count then.
double Path::surface_weight(const Bsdf::Sample& sample, double light_pdf, const LightLinks& links) const {
    if (!lit_by(links)) return 0;
    if (links.blockers != LightLinks().blockers && !sees_) return 0;
    if (sample.mirror || !(light_pdf > 0) || settings_.strategy == ReferenceStrategy::surfaces_only) return 1;
    if (settings_.strategy == ReferenceStrategy::lights_only) return 0;
    return power_heuristic(sample.pdf, light_pdf);
}

/// Absorbs light on the way to a surface. A solid that is left knows its inside, whatever the ray's origin knew. Rays
/// that meet panes by chance come from outside.
void Path::arrive(Surface& surface, double distance) {
    surface.emitted *= medium_.transmittance(distance);
    const BsdfParameters& p = surface.parameters;
    if (!surface.unlit && !p.front && p.is_solid() && !met_pane_) medium_ = p.inside;
    throughput_ *= medium_.transmittance(distance);
}

/// Adds the lights with a size that a camera ray meets up to a distance.
void Path::add_shown_lamps(const ReferenceRay& ray, double end) {
    const double unit = length(ray.direction);
    for (const MetLight& light : scene_.lights.met(ray.origin, ray.direction / unit, ray.t_min * unit, end)) {
        if (!std::isinf(light.distance) && light.distance > ray.t_max * unit) continue;
        result_.radiance.emission += light.radiance;
    }
}

PathResult Path::trace(const ReferenceRay& camera_ray) {
    const EnvironmentLight& environment = scene_.lights.environment();
    const dvec3 view = normalize(camera_ray.direction);
    const std::optional<ReferenceHit> hit = scene_.tracer.closest_hit(camera_ray, alpha());
    const double end = hit ? hit->t * length(camera_ray.direction) : std::numeric_limits<double>::infinity();
    if (!hit) {
        result_.radiance.emission = environment.radiance(view);
        if (settings_.show_lamps) add_shown_lamps(camera_ray, end);
        return result_;
    }
    result_.covered = true;
    Surface surface = make_surface(scene_.tracer, *hit, -view);
    arrive(surface, end);
    result_.radiance.emission = surface.emitted;
    if (settings_.show_lamps) add_shown_lamps(camera_ray, end);

    if (scene_.disperses) channel_ = static_cast<int>(3 * random_.uniform());
    for (bounce_ = 1; bounce_ <= settings_.bounces && !surface.unlit; ++bounce_) {
        Bsdf bsdf(surface.parameters, surface.wo, surface.n_g, surface.n, surface.n_k, channel_);
        if (met_pane_) bsdf.leave_out_straight();
        if (bsdf.disperses()) {
            dvec3 channel(0);
            channel[channel_] = one_channel_ ? 1 : 3;
            throughput_ *= channel;
            one_channel_ = true;
        }
        if (bsdf.black()) break;
        receiver_ = surface.triangle.instance;
        if (settings_.strategy != ReferenceStrategy::surfaces_only && !scene_.lights.empty())
            sample_light(surface, bsdf);

        const double u_lobe = random_.uniform(), u1 = random_.uniform(), u2 = random_.uniform();
        const std::optional<Bsdf::Sample> sample = bsdf.sample(u_lobe, u1, u2);
        if (!sample) break;
        if (bounce_ == 1) first_ = sample->component;
        throughput_ *= sample->weight;
        if (bounce_ >= 3) {
            const double survival = std::min(max_component(throughput_), 0.95);
            if (random_.uniform() >= survival) break;
            throughput_ /= survival;
        }

        medium_ = bsdf.medium_towards(sample->wi, medium_);
        sees_ = sees_ && sample->mirror;
        ReferenceRay ray{surface.leave(sample->wi), sample->wi};
        ray.passes_backs =
            settings_.backfaces == Backfaces::cull || (settings_.backfaces == Backfaces::automatic && sees_);
        const dvec3 from = surface.position;
        if (!follow(ray, surface, *sample)) {
            const dvec3 sky = environment.radiance(sample->wi) * medium_.transmittance(medium_.thickness);
            add(first_, throughput_ * sky *
                            surface_weight(*sample, scene_.lights.pdf_environment(sample->wi),
                                           scene_.tracer.scene().environment.links));
            break;
        }
        if (surface.emitted == dvec3(0)) continue;
        const double light_pdf = surface.unlit ? 0 : scene_.lights.pdf(from, surface);
        const LightLinks links = surface.unlit ? LightLinks() : scene_.tracer.links(surface.triangle);
        add(first_, surface.emitted * surface_weight(*sample, light_pdf, links));
    }
    return result_;
}

}  // namespace

Radiance& Radiance::operator+=(const Radiance& other) {
    emission += other.emission;
    for (std::size_t i = 0; i < 2; ++i) direct[i] += other.direct[i], indirect[i] += other.indirect[i];
    return *this;
}

PathResult trace_path(const Prepared& scene, const ReferenceSettings& settings, int x, int y, Random& random) {
    const double dx = filtered(settings.filter, random), dy = filtered(settings.filter, random);
    const ReferenceRay ray = camera_ray(scene, settings, {x, y}, x + 0.5 + dx, y + 0.5 + dy, &random);
    return ray.t_max < 0 ? PathResult() : Path(scene, settings, random).trace(ray);
}

std::optional<FirstSurface> first_surface(const Prepared& scene, const ReferenceSettings& settings, int x, int y) {
    const ReferenceRay ray = camera_ray(scene, settings, {x, y}, x + 0.5, y + 0.5);
    if (ray.t_max < 0) return std::nullopt;
    const auto pixel = (static_cast<std::uint64_t>(y) << 32) | static_cast<std::uint64_t>(x);
    const std::optional<ReferenceHit> hit = scene.tracer.closest_hit(ray, {combine(settings.seed, pixel)});
    if (!hit) return std::nullopt;
    const bool planar = settings.camera.optics.projection == Projection::camera;
    return FirstSurface{make_surface(scene.tracer, *hit, -normalize(ray.direction)),
                        planar ? hit->t : hit->t * length(ray.direction)};
}

}  // namespace halflight::reference
