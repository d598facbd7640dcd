// Fifty thousand small balls that mirror nothing: more than shadow rays are spared by what surrounds their lights.
#version 3.7;
global_settings { assumed_gamma 1.0 }

camera { location <0, 12, -26> look_at 0 right x*4/3 angle 50 }
light_source { <20, 40, -30>, rgb 0.6 }
light_source { <-25, 30, 5>, rgb 0.5 }
plane { y, -8 pigment { checker rgb 0.3 rgb 0.8 } }

#declare Random = seed(7);
#for (I, 1, 50000)
  sphere {
    <rand(Random) - 0.5, rand(Random) - 0.5, rand(Random) - 0.5>*<24, 14, 24>, 0.05 + 0.1*rand(Random)
    pigment { rgb <rand(Random), rand(Random), 0.5> }
  }
#end
