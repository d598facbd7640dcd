// A heap of glass balls: shadows that go through dozens of surfaces.
#version 3.7;
global_settings { assumed_gamma 1 max_trace_level 8 }
background { color rgb <0.2, 0.3, 0.5> }
camera { location <0, 6, -14> look_at 0 angle 50 }
light_source { <20, 30, -20> color rgb 1 }
light_source { <-20, 15, -10> color rgb 0.4 }
plane { y, -4 pigment { checker color rgb 1, color rgb 0.2 scale 2 } }
#declare S = seed(5);
#for (I, 1, 1000)
  sphere { <rand(S)*12 - 6, rand(S)*8 - 4, rand(S)*12 - 6>, 0.12 + 0.2*rand(S)
    pigment { color rgbf <0.9, 0.6 + 0.35*rand(S), 0.9, 0.9> }
    finish { specular 0.5 reflection 0.1 } interior { ior 1.5 } }
#end
