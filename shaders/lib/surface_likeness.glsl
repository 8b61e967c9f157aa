// Likeness of the surfaces at two pixels, for filters. guide: xyz: normal; w: ln(depth). reflectance: rgb: albedo; a:
// number of mirrors before the surface.
float likeness(vec4 guide_p, vec4 albedo_p, vec4 guide_q, vec4 albedo_q) {
    vec3 normals = guide_p.xyz - guide_q.xyz;
    vec3 albedos = albedo_p.rgb - albedo_q.rgb;
    float mirrors = albedo_p.a - albedo_q.a;
    float depths = guide_p.w - guide_q.w;
    return exp(-dot(normals, normals) / 0.09 - dot(albedos, albedos) / 0.25 - depths * depths / 0.04 -
               mirrors * mirrors / 0.25);
}
