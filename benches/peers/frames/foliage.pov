// Instances that let light through: 1,600 crowns of 3,000 leaves, which are one mesh and tint their shadows.
#version 3.7;
global_settings { assumed_gamma 1.0 max_trace_level 12 }
background { color rgb <0.4, 0.5, 0.7> }
camera { location <0, 9, -26> look_at <0, 0.5, -2> angle 46 right x*image_width/image_height }
light_source { <-40, 60, -40> color rgb 0.9 }
light_source { <50, 30, -20> color rgb <0.3, 0.3, 0.35> }
plane { y, 0 pigment { checker color rgb 0.8, color rgb 0.5 } finish { ambient 0.05 diffuse 0.7 } }
#declare S = seed(7);
#macro Any() <2*rand(S) - 1, 2*rand(S) - 1, 2*rand(S) - 1> #end
#declare Crown = mesh {
  #for (K, 1, 3000)
    #local P = vnormalize(Any())*pow(rand(S), 0.4);
    #local A = 0.03*vnormalize(Any());
    #local B = 0.02*vnormalize(vcross(A, Any()));
    triangle { P, P + A + B, P + 2*A }
    triangle { P, P + 2*A, P + A - B }
  #end
}
#for (I, 0, 39)
  #for (J, 0, 39)
    object { Crown
      rotate <40*rand(S) - 20, 360*rand(S), 40*rand(S) - 20>
      scale 0.25 + 0.3*rand(S)
      translate <0.6*(I - 19.5), 0.5, 0.6*(J - 19.5)>
      pigment { color rgbf <0.2 + 0.6*rand(S), 0.5 + 0.5*rand(S), 0.2 + 0.3*rand(S), 0.4> }
      finish { ambient 0.05 diffuse 0.7 }
    }
  #end
#end
