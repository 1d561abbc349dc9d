// Linear sRGB for a display: the twin of optics/display.py, whose constants are defined as macros if
// the view is `natural`; without them each channel is clipped by itself.

#ifdef DISPLAY_GREY

// Move a colour towards grey of its luminance until all channels are 0 to `most`.
vec3 fitted_to(vec3 light, vec3 luminance, float most)
{
    float grey = clamp(dot(light, luminance), 0.0, most);
    vec3 away = light - vec3(grey);
    float below = grey / max(-min(away.r, min(away.g, away.b)), 1e-30);
    float above = (most - grey) / max(max(away.r, max(away.g, away.b)), 1e-30);
    return clamp(vec3(grey) + min(1.0, min(below, above)) * away, 0.0, most);
}

// One channel of the sigmoid.
float display_curve(float x)
{
    float away = DISPLAY_SLOPE * abs(x - DISPLAY_PIVOT.x);
    bool dark = x < DISPLAY_PIVOT.x;
    vec2 bend = dark ? DISPLAY_TOE : DISPLAY_SHOULDER;  // power, scale
    float change = away / pow(1.0 + pow(away / bend.y, bend.x), 1.0 / bend.x);
    return clamp(DISPLAY_PIVOT.y + (dark ? -change : change), 0.0, 1.0);
}

vec3 displayed(vec3 linear)
{
    // 1e20 times a matrix's entry is far from the largest float
    vec3 wide = DISPLAY_TO_WIDE * clamp(linear, -1e20, 1e20);
    wide = DISPLAY_INSET * fitted_to(wide, DISPLAY_WIDE_LUMINANCE, 1e20);
    vec3 x = (log2(max(wide, DISPLAY_DARKEST) / DISPLAY_GREY) + DISPLAY_BELOW) / DISPLAY_STOPS;
    x = clamp(x, 0.0, 1.0);
    vec3 curved = vec3(display_curve(x.r), display_curve(x.g), display_curve(x.b));
    wide = pow(max(DISPLAY_OUTSET * curved, 0.0), vec3(DISPLAY_GAMMA));
    return encode_srgb(fitted_to(DISPLAY_FROM_WIDE * wide, DISPLAY_LUMINANCE, 1.0));
}

#else

vec3 displayed(vec3 linear)
{
    return encode_srgb(linear);
}

#endif
