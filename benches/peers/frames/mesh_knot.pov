// 256000-triangle torus knot, mirror-like, over a checkered floor. Needs knot.inc (meshes.py) on the library path.
#version 3.7;
global_settings { assumed_gamma 1.0 max_trace_level 10 }
background { color rgb <0.25, 0.3, 0.4> }
camera { location <0.6, 2.6, 3.2> look_at <0, 0, 0> angle 62 right x*image_width/image_height }
light_source { <4, 6, 5> color rgb 0.8 }
light_source { <-5, 4, 3> color rgb <0.3, 0.3, 0.4> }
object { #include "knot.inc"
  pigment { color rgb <0.9, 0.7, 0.3> } finish { ambient 0.04 diffuse 0.35 specular 0.7 roughness 0.01 metallic reflection { 0.5 metallic } }
}
plane { y, -0.9 pigment { checker color rgb 0.8, color rgb 0.2 } finish { ambient 0.05 diffuse 0.75 reflection { 0.05 } } }
