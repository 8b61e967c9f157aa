// Likeness of the surfaces at two pixels, for filters. guide: xyz: mean normal; w: ln(depth). reflectance: rgb: albedo;
// a: number of mirrors before the surface. mixed: share of the variance of p's normals that explains how q's differ.
float likeness(vec4 guide_p, vec4 albedo_p, vec4 guide_q, vec4 albedo_q, float mixed) {
    vec3 normals = guide_p.xyz - guide_q.xyz;
    // The mean of unit normals n_i is shorter than 1 by their variance: mean |n_i - n|^2 = 1 - |n|^2.
    float variance = mixed * max(1.0 - dot(guide_p.xyz, guide_p.xyz), 0.0);
    vec3 albedos = albedo_p.rgb - albedo_q.rgb;
    float mirrors = albedo_p.a - albedo_q.a;
    float depths = guide_p.w - guide_q.w;
    return exp(-max(dot(normals, normals) - variance, 0.0) / 0.09 - dot(albedos, albedos) / 0.25 - depths * depths / 0.04 -
               mirrors * mirrors / 0.25);
}
