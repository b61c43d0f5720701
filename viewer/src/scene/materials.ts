/** Materials: the wall itself, its mask for outlines, and the outline drawn over the picture. */

import { Color, GLSL3, NoBlending, NormalBlending, ShaderMaterial, Vector2 } from "three";
import type { Texture } from "three";
import type { Part } from "../tiers/read_wall";
import { rampColours } from "./heatmap";
import { STATE_WIDTH } from "./hold_state";

const LOOKUP = /* glsl */ `
  // The hold whose border is near, and how far inside its smooth border curve this place lies.
  in float near;
  in float depth;
  uniform sampler2D uState;
  vec4 stateOf(float feature) {
    int id = int(feature + 0.5);
    return texelFetch(uState, ivec2(id % ${STATE_WIDTH}, id / ${STATE_WIDTH}), 0);
  }`;

const WALL_VERTEX = /* glsl */ `
  ${LOOKUP}
  flat out vec2 vFull;
  flat out float vHeat;
  // centroid: a smoothed edge samples beside its triangle, where so steep a value is far off.
  centroid out float vDepth;
  out vec3 vView;
  #ifdef USE_MAP_UV
    out vec2 vTexel;
  #endif
  #ifdef USE_TINT
    in vec3 color;
    out vec3 vTint;
  #endif
  void main() {
    vFull = vec2(stateOf(0.0).r, stateOf(near).r);
    vHeat = stateOf(near).b;
    vDepth = depth;
    #ifdef USE_MAP_UV
      vTexel = uv;
    #endif
    #ifdef USE_TINT
      vTint = color;
    #endif
    vec4 place = modelViewMatrix * vec4(position, 1.0);
    vView = place.xyz;
    gl_Position = projectionMatrix * place;
  }`;

const WALL_FRAGMENT = /* glsl */ `
  uniform sampler2D uMap;
  uniform vec3 uBackdrop;
  uniform float uFade;
  uniform vec3 uRamp[3];
  flat in vec2 vFull;
  flat in float vHeat;
  centroid in float vDepth;
  in vec3 vView;
  #ifdef USE_MAP_UV
    in vec2 vTexel;
  #endif
  #ifdef USE_TINT
    in vec3 vTint;
  #endif
  out vec4 colour;
  void main() {
    vec3 base = vec3(0.62);
    #ifdef USE_TINT
      base = vTint;
    #endif
    #ifdef USE_MAP_UV
      base = texture(uMap, vTexel).rgb;
    #elif !defined(USE_TINT)
      vec3 normal = normalize(cross(dFdx(vView), dFdy(vView)));
      base *= 0.45 + 0.55 * abs(normal.z) ;
    #endif
    float grey = dot(base, vec3(0.2126, 0.7152, 0.0722));
    vec3 faded = mix(mix(vec3(grey), base, 0.12), uBackdrop, 0.55);
    float pixel = max(length(fwidth(vView.xy)), 1e-9);
    float inside = clamp(vDepth / pixel + 0.5, 0.0, 1.0);
    float full = mix(vFull.x, vFull.y, inside);
    vec3 shown = mix(base, faded, uFade * (1.0 - full));
    if (vHeat > 0.0) {
      // 1 is no heat and 255 all of it; the hold's own shading stays to be seen.
      float heat = (vHeat * 255.0 - 1.0) / 127.0;
      vec3 hue = heat < 1.0 ? mix(uRamp[0], uRamp[1], heat) : mix(uRamp[1], uRamp[2], heat - 1.0);
      shown = mix(shown, hue * (0.75 + 0.5 * sqrt(grey)), inside);
    }
    colour = vec4(shown, 1.0);
    colour = linearToOutputTexel(colour);
  }`;

export interface WallLook {
  uState: { value: Texture };
  uFade: { value: number };
  uBackdrop: { value: Color };
}

/** The wall's own material: the photo's colours, unlit; faded where the state says so. */
export function wallMaterial(part: Pick<Part, "map" | "coloured">, look: WallLook): ShaderMaterial {
  const defines: Record<string, string> = {};
  if (part.map) defines["USE_MAP_UV"] = "";
  else if (part.coloured) defines["USE_TINT"] = "";
  return new ShaderMaterial({
    glslVersion: GLSL3,
    vertexShader: WALL_VERTEX,
    fragmentShader: WALL_FRAGMENT,
    defines,
    uniforms: { ...look, uMap: { value: part.map }, uRamp: { value: rampColours() } },
  });
}

/** Draws outline kind and a short hash of the id, for `outlineMaterial` to find borders in. */
export function maskMaterial(look: WallLook): ShaderMaterial {
  return new ShaderMaterial({
    glslVersion: GLSL3,
    blending: NoBlending,
    vertexShader: /* glsl */ `
      ${LOOKUP}
      flat out vec2 vMark;
      out float vDepth;
      void main() {
        vMark = vec2(stateOf(near).g, mod(near, 251.0) / 255.0);
        vDepth = depth;
        gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
      }`,
    fragmentShader: /* glsl */ `
      flat in vec2 vMark;
      in float vDepth;
      out vec4 colour;
      void main() { colour = vec4(vDepth > 0.0 ? vMark : vec2(0.0), 0.0, 1.0); }`,
    uniforms: { uState: look.uState },
  });
}

/** A white line with a dark halo around marked holds, visible without colour vision. */
export function outlineMaterial(mask: Texture): ShaderMaterial {
  return new ShaderMaterial({
    glslVersion: GLSL3,
    blending: NormalBlending,
    premultipliedAlpha: true,
    transparent: true,
    depthTest: false,
    depthWrite: false,
    vertexShader: /* glsl */ `
      void main() { gl_Position = vec4(position.xy, 0.0, 1.0); }`,
    fragmentShader: /* glsl */ `
      uniform sampler2D uMask;
      uniform vec2 uPixel;
      uniform float uDense;
      uniform float uStrength;
      out vec4 colour;
      const int RING = 16;
      void main() {
        vec2 here = gl_FragCoord.xy * uPixel;
        vec2 own = texture(uMask, here).rg;
        float line = 0.0, halo = 0.0, chosen = 0.0;
        for (int k = 0; k < RING; k++) {
          float turn = 6.2831853 * float(k) / float(RING);
          vec2 way = vec2(cos(turn), sin(turn)) * uPixel * uDense;
          vec2 near = texture(uMask, here + way * 2.2).rg;
          vec2 far = texture(uMask, here + way * 5.0).rg;
          if (near.r > 0.0 && near != own) {
            line += 1.0;
            chosen = max(chosen, near.r * 255.0);
          }
          if (far.r > 0.0 && far != own) halo += 1.0;
        }
        line = smoothstep(0.0, 0.3, line / float(RING));
        halo = smoothstep(0.0, 0.6, halo / float(RING)) * 0.55 * (own.r > 0.0 ? 0.0 : 1.0);
        // Beyond the route's white, the chosen hold is ringed in blue and the keyboard's cursor in orange.
        vec3 ink = chosen > 3.5 ? vec3(1.0, 0.6, 0.0) : chosen > 1.5 ? vec3(0.24, 0.56, 1.0) : vec3(1.0);
        float alpha = max(line, halo) * uStrength;
        colour = vec4(mix(vec3(0.0), ink, line) * alpha, alpha);
      }`,
    uniforms: {
      uMask: { value: mask },
      uPixel: { value: new Vector2() },
      uDense: { value: 1 },
      uStrength: { value: 1 },
    },
  });
}
