// Dishes, saddles and bowls of quadrics: without an end, clipped, and as parts of intersections.
#version 3.7;
global_settings { assumed_gamma 1.0 }

camera { location <0, 9, -18> look_at <0, 0, 1> right x*4/3 angle 50 }
light_source { <8, 25, -15>, rgb 0.6 }
light_source { <-12, 18, -6>, rgb 0.5 }

#declare Bowl = quadric { <1, 0, 1>, <0, 0, 0>, <0, -1, 0>, 0 }
#declare Waist = quadric { <1, -0.4, 1>, <0, 0, 0>, <0, 0, 0>, -0.1 }
// Saddles to the horizon.
quadric { <0.02, 0, -0.02>, <0, 0, 0>, <0, 1, 0>, 3 pigment { checker rgb 0.35 rgb 0.7 scale 2 } }
#for (I, -6, 6)
  #for (J, -3, 6)
    #local At = <2*I + mod(J + 3, 2), -1, 2*J>;
    #switch (mod(I + J + 12, 3))
      #case (0) object { Bowl clipped_by { box { <-1, -0.1, -1>, <1, 0.8, 1> } } bounded_by { clipped_by } pigment { rgb <0.8, 0.5, 0.3> } translate At } #break
      #case (1) intersection { object { Waist } plane { y, 0.9 } plane { -y, 0.9 } bounded_by { box { -0.95, 0.95 } } pigment { rgb <0.4, 0.6, 0.8> } translate At } #break
      #else quadric { <1, 1.5, 2>, <0.5, 0, 0>, <0, 0, 0>, -0.5 pigment { rgb <0.5, 0.8, 0.4> } finish { reflection 0.2 phong 0.5 } translate At }
    #end
  #end
#end
// Bowls without an end, about and above.
#for (I, 0, 11)
  object { Bowl scale 0.4 + 0.05*I rotate 180*x translate <-22 + 4*I, 9 + mod(I, 3), 26> pigment { rgb <0.7, 0.7, 0.4> } }
#end
