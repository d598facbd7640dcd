// Instances: 2,500 places of one mesh of 20,000 triangles, most of them smaller than a pixel.
#version 3.7;
global_settings { assumed_gamma 1.0 max_trace_level 5 }
background { color rgb <0.4, 0.5, 0.7> }
camera { location <0, 14, -30> look_at <0, 0, -2> angle 50 right x*image_width/image_height }
light_source { <-40, 60, -40> color rgb 0.9 }
light_source { <50, 30, -20> color rgb <0.3, 0.3, 0.35> }
plane { y, 0 pigment { checker color rgb 0.8, color rgb 0.5 } finish { ambient 0.05 diffuse 0.7 } }
#declare N = 100;
#declare Bush = mesh2 {
  vertex_vectors { (N + 1)*N,
    #declare I = 0;
    #while (I <= N)
      #declare J = 0;
      #while (J < N)
        #declare U = 2*pi*J/N;
        #declare V = pi*(I + 0.5)/(N + 1);
        #declare R = 1 + 0.2*sin(7*U)*sin(5*V);
        <R*sin(V)*cos(U), 1.5*R*cos(V), R*sin(V)*sin(U)>,
        #declare J = J + 1;
      #end
      #declare I = I + 1;
    #end
  }
  face_indices { 2*N*N,
    #declare I = 0;
    #while (I < N)
      #declare J = 0;
      #while (J < N)
        #declare A = I*N + J;
        #declare B = I*N + mod(J + 1, N);
        <A, B, A + N>, <B, B + N, A + N>,
        #declare J = J + 1;
      #end
      #declare I = I + 1;
    #end
  }
}
#declare S = seed(7);
#declare I = 0;
#while (I < 50)
  #declare J = 0;
  #while (J < 50)
    object {
      Bush
      rotate <40*rand(S) - 20, 360*rand(S), 40*rand(S) - 20>
      scale 0.12 + 0.12*rand(S)
      translate <0.56*(I - 24.5), 0.25, 0.56*(J - 24.5)>
      pigment { color rgb <0.2 + 0.6*rand(S), 0.4 + 0.5*rand(S), 0.2 + 0.3*rand(S)> }
      finish { ambient 0.05 diffuse 0.7 reflection 0.1 }
    }
    #declare J = J + 1;
  #end
  #declare I = I + 1;
#end
