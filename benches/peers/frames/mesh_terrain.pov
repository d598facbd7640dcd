// 524288-triangle terrain. Needs terrain.inc (meshes.py) on the library path.
#version 3.7;
global_settings { assumed_gamma 1.0 max_trace_level 10 }
background { color rgb <0.45, 0.6, 0.85> }
camera { location <0, 4.5, 13> look_at <0, -1, 0> angle 58 right x*image_width/image_height }
light_source { <12, 14, 6> color rgb 1 }
object { #include "terrain.inc"
  pigment { color rgb <0.55, 0.6, 0.4> } finish { ambient 0.06 diffuse 0.8 }
}
plane { y, -0.6
  pigment { color rgb <0.15, 0.25, 0.35> } finish { ambient 0.02 diffuse 0.2 specular 0.6 roughness 0.005 reflection { 0.5 } }
}
