"""Published shader files, parsed to kernels of the typed representation."""

#: Suffixes of shader files.
SUFFIXES = (".fs", ".glsl", ".frag", ".fsh", ".hook", ".glslp")
#: Suffix of Shadertoy's exports, and of flat worlds; as an effect it means a shader.
EXPORT_SUFFIX = ".json"
#: Seconds from frame to frame, if nothing else says so.
STEP_S = 1 / 30
#: Suffixes of other shader files, with their kind, and what to do.
NOT_READ = {
    ".slangp": ("a preset of libretro's Slang shaders", "most have a .glslp beside them, which is read"),
    ".slang": ("a Slang shader", "libretro's mostly have a .glsl beside them, which is read; else give its GLSL"),
    ".gdshader": ("a shader of Godot", "write its fragment() as GLSL: uniforms, in vec2 UV, out vec4 COLOR and main()"),
    ".vert": ("a vertex shader", "give the fragment shader that goes with it (.frag), which finds it"),
    ".vs": ("a vertex shader", "give the fragment shader that goes with it (.fs), which finds it"),
    ".comp": ("a compute shader", "write it as a fragment shader, which gives its own pixel a color"),
    ".geom": ("a geometry shader", "give the fragment shader that goes with it (.frag)"),
    **dict.fromkeys((".hlsl", ".fx", ".cg", ".cgfx"), ("HLSL or Cg", "translate it to GLSL first")),
    ".wgsl": ("WGSL", "translate it to GLSL first (naga, tint)"),
    ".metal": ("Metal's language", "translate it to GLSL first"),
    ".spv": ("SPIR-V", "translate it to GLSL first (spirv-cross)"),
}
