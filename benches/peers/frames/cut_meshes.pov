// A composite of a mesh in many places: a ring of 20,000 triangles, cut open and bitten, a hundred times.
#version 3.7;
global_settings { assumed_gamma 1.0 max_trace_level 10 }
background { color rgb <0.3, 0.5, 0.7> }
camera { location <0, 9, -15> look_at <0, 0, -1> angle 45 right x*image_width/image_height }
light_source { <5, 8, -6> color rgb 0.9 }
light_source { <-7, 6, -3> color rgb <0.25, 0.3, 0.35> }
plane { y, -0.5 pigment { checker color rgb 0.75, color rgb 0.3 } }
#declare N = 100;
#macro At(U, V)
  #local A = 2*pi*U/N;
  #local B = 2*pi*V/N;
  <(1.2 + 0.45*cos(B))*cos(A), 0.45*sin(B), (1.2 + 0.45*cos(B))*sin(A)>
#end
#declare Ring = mesh {
  #for (U, 0, N - 1)
    #for (V, 0, N - 1)
      triangle { At(U, V), At(U + 1, V), At(U + 1, V + 1) }
      triangle { At(U, V), At(U + 1, V + 1), At(U, V + 1) }
    #end
  #end
  inside_vector y
}
#declare Bitten = difference {
  object { Ring }
  box { <-2, 0.001, -2>, <0.2, 2, 2> }
  sphere { <1.2, 0.3, -0.2>, 0.5 }
}
#declare Turn = seed(3);
#for (K, 0, 99)
  object { Bitten
    scale 0.4
    rotate <40*rand(Turn) - 20, 360*rand(Turn), 40*rand(Turn) - 20>
    translate <1.3*mod(K, 10) - 5.85, 0, 1.3*div(K, 10) - 6.5>
    pigment { color rgb <0.4 + 0.6*rand(Turn), 0.5, 0.3 + 0.5*rand(Turn)> }
    finish { specular 0.5 roughness 0.02 reflection 0.15 }
  }
#end
