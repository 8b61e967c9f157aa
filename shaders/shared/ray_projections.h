// Projections that no rasterizer draws, and pictures of two eyes: the direction of a camera ray, and its inverse
// (SHADING.md, Projections and eyes). Camera coordinates have x to the right, y up and z backwards.
#pragma once

#include "shaders/shared/arctangent.h"
#include "shaders/shared/portable.h"

HALFLIGHT_SHARED_BEGIN

// Values of Optics::projection.
HALFLIGHT_SHARED_CONST uint kPerspective = 0u;
HALFLIGHT_SHARED_CONST uint kPanorama = 1u;
HALFLIGHT_SHARED_CONST uint kFisheye = 2u;
HALFLIGHT_SHARED_CONST uint kEquisolid = 3u;
// Values of Optics::layout.
HALFLIGHT_SHARED_CONST uint kOneEye = 0u;
HALFLIGHT_SHARED_CONST uint kOverUnder = 1u;   // the second eye is in the lower half of the picture
HALFLIGHT_SHARED_CONST uint kSideBySide = 2u;  // the second eye is in the right half of the picture

// Plane coordinates are x right and y up from the picture's centre, with one unit per radian there.
struct Optics {
    vec2 half_extent;     // half of the width and height of one eye's picture, plane coordinates
    float circle;         // radius of the image circle of a fisheye, plane coordinates; 0: no circle
    float eye;            // place of the first eye to the right of the camera, world units; the second is opposite
    float toe_in;         // 1 / distance at which the lines of sight of both eyes meet, 0: parallel
    uint projection;      // kPerspective, ...
    uint layout_of_eyes;  // kOneEye, ...
    float earlier_zoom;   // half_extent of the previous frame over that of this one
};
HALFLIGHT_SHARED_SIZE(Optics, 32)

// Returns the size of one eye's picture, pixels.
HALFLIGHT_SHARED_FUNCTION vec2 eye_size(Optics o, ivec2 image) {
    return vec2(float(image.x) * (o.layout_of_eyes == kSideBySide ? 0.5f : 1.0f),
                float(image.y) * (o.layout_of_eyes == kOverUnder ? 0.5f : 1.0f));
}

// Returns whether a pixel shows the second eye.
HALFLIGHT_SHARED_FUNCTION bool shows_second_eye(Optics o, ivec2 pixel, ivec2 image) {
    return (o.layout_of_eyes == kOverUnder && 2 * pixel.y >= image.y) ||
           (o.layout_of_eyes == kSideBySide && 2 * pixel.x >= image.x);
}

// Returns the upper left corner of an eye's picture, pixels.
HALFLIGHT_SHARED_FUNCTION vec2 eye_corner(Optics o, bool second, ivec2 image) {
    return vec2(second && o.layout_of_eyes == kSideBySide ? 0.5f * float(image.x) : 0.0f,
                second && o.layout_of_eyes == kOverUnder ? 0.5f * float(image.y) : 0.0f);
}

// Returns the plane coordinates of a place in the picture, pixels from its upper left corner.
HALFLIGHT_SHARED_FUNCTION vec2 plane_of_place(Optics o, bool second, vec2 place, ivec2 image) {
    vec2 at = 2.0f * (place - eye_corner(o, second, image)) / eye_size(o, image) - 1.0f;
    return vec2(at.x * o.half_extent.x, -at.y * o.half_extent.y);
}

// Returns the place of plane coordinates in the picture.
HALFLIGHT_SHARED_FUNCTION vec2 place_of_plane(Optics o, bool second, vec2 plane, ivec2 image) {
    vec2 at = vec2(plane.x / o.half_extent.x, -plane.y / o.half_extent.y);
    return eye_corner(o, second, image) + (0.5f * at + 0.5f) * eye_size(o, image);
}

// Returns the place of an eye to the right of the camera, world units.
HALFLIGHT_SHARED_FUNCTION float eye_of(Optics o, bool second) {
    return second ? -o.eye : o.eye;
}

// Returns whether plane coordinates lie in the image circle.
HALFLIGHT_SHARED_FUNCTION bool in_image_circle(Optics o, vec2 plane) {
    return o.circle == 0.0f || dot(plane, plane) <= o.circle * o.circle;
}

// Returns the direction that the camera itself sees at plane coordinates. Its length is 1, and for a perspective 1
// along the camera's axis. Outside of the image circle, it is any direction.
HALFLIGHT_SHARED_FUNCTION vec3 seen_direction(Optics o, vec2 plane) {
    if (o.projection == kPanorama) return vec3(cos(plane.y) * sin(plane.x), sin(plane.y), -cos(plane.y) * cos(plane.x));
    float r = length(plane);
    if (o.projection == kFisheye) return vec3(plane * (r > 0.0f ? sin(r) / r : 1.0f), -cos(r));
    if (o.projection == kEquisolid) return vec3(plane * sqrt(max(1.0f - 0.25f * r * r, 0.0f)), 0.5f * r * r - 1.0f);
    return vec3(plane, -1.0f);
}

// Returns the place of an eye, camera coordinates. In panoramas, both eyes turn with the longitude (Ishiguro, Yamamoto,
// Tsuji 1992, Omni-Directional Stereo).
HALFLIGHT_SHARED_FUNCTION vec3 eye_place(Optics o, float eye, vec2 plane) {
    return o.projection == kPanorama ? vec3(eye * cos(plane.x), 0.0f, eye * sin(plane.x)) : vec3(eye, 0.0f, 0.0f);
}

// Returns the plane coordinates at which an eye sees a point, and 1 in z; 0 there if the eye does not see it.
// point: camera coordinates.
HALFLIGHT_SHARED_FUNCTION vec3 plane_of_point(Optics o, float eye, vec3 point) {
    if (o.projection == kPanorama) {
        // From the camera to the point: t along the direction that the camera itself sees, and `aside` along the line
        // through both eyes. They are perpendicular, t^2 + aside^2 = |point|^2, and aside = eye (1 - toe_in t).
        float k = eye * o.toe_in;
        float square = 1.0f + k * k;
        float t = (eye * k + sqrt(max(eye * k * eye * k + square * (dot(point, point) - eye * eye), 0.0f))) / square;
        float aside = eye - k * t;
        float level = length(vec2(point.x, point.z));
        float forward = sqrt(max(level * level - aside * aside, 0.0f));
        float longitude =
            level > 0.0f ? arctangent(point.x, -point.z) - arctangent(aside, forward) : 0.0f;  // 0 at a pole
        longitude -= 6.283185307180f * round(longitude / 6.283185307180f);
        return vec3(longitude, arctangent(point.y, forward),
                    level >= abs(aside) && dot(point, point) > 0.0f ? 1.0f : 0.0f);
    }
    vec3 away = point - vec3(eye, 0.0f, 0.0f);
    if (o.projection == kPerspective) {
        return away.z < 0.0f ? vec3(away.x / -away.z + eye * o.toe_in, away.y / -away.z, 1.0f) : vec3(0.0f);
    }
    // The direction that the camera itself sees is away / t + (eye toe_in, 0, 0), of length 1.
    float k = eye * o.toe_in;
    float square = dot(away, away);
    float along = k * away.x;
    vec3 d = away * ((sqrt(max(along * along + square * (1.0f - k * k), 0.0f)) - along) / square) + vec3(k, 0.0f, 0.0f);
    float level = length(vec2(d.x, d.y));
    float angle = arctangent(level, -d.z);
    float r = o.projection == kFisheye ? angle : 2.0f * sin(0.5f * angle);
    float scale = level > 0.0f ? r / level : 0.0f;
    return vec3(d.x * scale, d.y * scale, square > 0.0f ? 1.0f : 0.0f);
}

// Returns the way that a point moves in the picture of an eye, from plane coordinates `before` to `now`, pixels. In
// panoramas, it is the shorter way around.
HALFLIGHT_SHARED_FUNCTION vec2 way_of_plane(Optics o, bool second, vec2 before, vec2 now, ivec2 image) {
    vec2 way = place_of_plane(o, second, now, image) - place_of_plane(o, second, before, image);
    float around = eye_size(o, image).x;
    if (o.projection == kPanorama) way.x -= around * round(way.x / around);
    return way;
}

HALFLIGHT_SHARED_END
