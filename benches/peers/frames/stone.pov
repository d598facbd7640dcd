// Stone, wood and clouds: floors and balls whose patterns are put out of order by turbulence, in layers, as those of POV-Ray's own textures are.
#version 3.7;
global_settings { assumed_gamma 1.0 }

camera { location <0, 6, -14> look_at <0, 0.5, 0> right x*4/3 angle 50 }
light_source { <8, 20, -15>, rgb 0.9 }
background { rgb <0.3, 0.4, 0.6> }

#declare Pale = color_map { [0 rgb <0.7, 0.6, 0.5>] [0.6 rgb 0.8] [1 rgb 0.95] }
#declare Veins = color_map { [0 rgbt <0.3, 0.2, 0.1, 0.2>] [0.3 rgbt <0.8, 0.7, 0.6, 0.8>] [1 rgbt <0.6, 0.4, 0.3, 1>] }
#declare Dark = color_map { [0 rgb <0.25, 0.12, 0.05>] [0.5 rgb <0.55, 0.3, 0.12>] [1 rgb <0.8, 0.55, 0.3>] }

#declare Marble = texture { pigment { marble turbulence 0.7 color_map { Pale } scale 0.7 } finish { phong 0.3 } }
  texture { pigment { granite turbulence 0.4 color_map { Veins } scale 0.8 } finish { phong 0.3 } }
  texture { pigment { bozo turbulence 0.6 octaves 8 lambda 2.2 color_map { Veins } scale 1.3 } finish { phong 0.3 } }
#declare Oak = texture { pigment { wood turbulence 0.08 octaves 4 color_map { Dark } scale 0.25 rotate <4, 20, 0> } finish { phong 0.2 } }
#declare Agate = texture { pigment { agate turbulence 0.3 color_map { Dark } scale 0.8 } finish { phong 0.5 } }
#declare Cloth = texture { pigment { wrinkles color_map { Pale } scale 0.4 } }

plane { y, -1 texture { Marble } }
#for (I, -3, 3)
  sphere { <3*I, 0.2, 1>, 1.2
    #switch (mod(I + 9, 3))
      #case (0) texture { Oak } #break
      #case (1) texture { Agate } #break
      #else texture { Cloth }
    #end
  }
  box { <-0.9, -1, -0.9>, 0.9 texture { Oak rotate 90*x } rotate 25*I*y translate <2.6*I, 0, 5> }
#end
