# Draws the tables that gnomon_figures wrote:  gnuplot -e "folder='out/figures'" samples/figures/plot.gp
set encoding utf8
set datafile separator comma
set datafile columnheaders
set grid lc rgb '#e0e0e0' lt 1
set border 3
set tics nomirror out
set key samplen 1.5 spacing 1.1
svg(name, width, height) = sprintf("set terminal svg size %d,%d font 'DejaVu Sans,11' background 'white'; set output '%s/%s.svg'", width, height, folder, name)
table(name) = folder . '/' . name . '.csv'
grey = '#888888'; red = '#c0392b'; blue = '#2471a3'; green = '#1e8449'; gold = '#b7950b'; purple = '#7d3c98'

# Fig. 5 and 6: error along the view, and against the warp.
eval svg('error', 1000, 340)
set multiplot layout 1,3
set title 'error across the view'; set xlabel 'z / n'; set ylabel 'm_x' norotate offset 1
set logscale xy
t = table('error_along_view')
of(e, name) = abs(column('eta') - e) < 1e-6 ? column(name) : NaN
array Eta[5] = [-1, -0.5, 0, 0.5, 1]
array Colour[5] = [grey, gold, green, blue, red]
array Name[5] = ["none", "η = -0.5", "LiSPSM", "η = 0.5", "PSM"]
set xtics (1,2,5,10,20)
plot [1:20] [0.5:40] for [i=1:5] t using 'z':(of(Eta[i], 'x')) with lines lc rgb Colour[i] notitle, \
  for [i=1:5] t using 'z':(of(Eta[i], 'emitted_x')) with points pt 6 ps 0.5 lc rgb Colour[i] title Name[i]
set title 'error along the view'; set ylabel 'm_z'
plot [1:20] [0.5:40] for [i=1:5] t using 'z':(of(Eta[i], 'z_error')) with lines lc rgb Colour[i] notitle, \
  for [i=1:5] t using 'z':(of(Eta[i], 'emitted_z')) with points pt 6 ps 0.5 lc rgb Colour[i] notitle
set title 'greatest errors and storage'; set xlabel 'η  (-1 none, 0 LiSPSM, 1 PSM)'; set ylabel ''
unset logscale x; set xtics -1,0.5,1 
t = table('error_against_warp')
plot [-1:1] [1:3e5] t using 'eta':'M_x' with lines lc rgb blue notitle, t using 'eta':'M_z' with lines lc rgb green notitle, \
  t using 'eta':'S' with lines lc rgb red notitle, \
  t using 'eta':'emitted_x' with points pt 6 ps 0.5 lc rgb blue title 'M_x', t using 'eta':'emitted_z' with points pt 6 ps 0.5 lc rgb green title 'M_z', \
  t using 'eta':'emitted_S' with points pt 6 ps 0.5 lc rgb red title 'S', t using 'eta':'edges_S' with points pt 2 ps 0.5 lc rgb grey title 'S by texel edges'
unset multiplot

# Fig. 10, 12 and 13: storage against slices and maps; where faces win.
eval svg('storage', 1000, 340)
set multiplot layout 1,3
set logscale y; set xtics autofreq
set title 'light overhead, f/n = 1000'; set xlabel 'slices k'; set ylabel 'S'
t = table('storage_against_slices')
plot [1:16] [4:1e4] t using 'k':'zp' with lines lc rgb grey notitle, t using 'k':'zpw' with lines lc rgb green notitle, \
  t using 'k':'optimal' with lines dt 2 lc rgb 'black' title 'least possible', \
  t using 'k':'emitted_zp' with points pt 6 ps 0.5 lc rgb grey title 'ZP', t using 'k':'emitted_zpw' with points pt 6 ps 0.5 lc rgb green title 'ZP+W'
set title 'overhead and behind, f/n = 1000'; set xlabel 'maps'
t = table('storage_against_maps')
plot [1:32] [4:1e4] t using 'maps':'behind_zp' with lines lc rgb red notitle, t using 'maps':'behind_fp' with lines lc rgb blue notitle, \
  t using 'maps':'overhead_fp' with lines lc rgb purple notitle, t using 'maps':'overhead_zpw' with lines lc rgb green notitle, \
  t using 'maps':'emitted_behind_zp' with points pt 6 ps 0.5 lc rgb red title 'ZP, ZP+W behind', \
  t using 'maps':'emitted_behind_fp' with points pt 6 ps 0.5 lc rgb blue title 'FP+ZP+W behind', \
  t using 'maps':'emitted_overhead_fp' with points pt 6 ps 0.5 lc rgb purple title 'FP+ZP+W overhead', \
  t using 'maps':'emitted_overhead_zpw' with points pt 6 ps 0.5 lc rgb green title 'ZP+W overhead'
set title 'light behind: which needs less'; set ylabel 'f/n'
t = table('faces_against_slices')
set label 1 'slices (ZP)' at 6,3e4; set label 2 'faces (FP+ZP+W)' at 19,350
set key bottom right
plot [5:32] [1:1e6] 1000 with lines dt 3 lc rgb grey notitle, \
  t using 'maps':'equal_rows' with steps lc rgb blue title 'equal rows', \
  t using 'maps':'any_rows' with lines lc rgb red title 'rows dealt evenly', t using 'maps':'emitted' with points pt 6 ps 0.5 lc rgb red title 'emitted', \
  t using 'maps':'edges' with points pt 2 ps 0.5 lc rgb grey title 'by texel edges'
unset label; set key top right
unset multiplot

# Sec. 4.3 and its retraction; Fig. 14.
eval svg('light-and-time', 1000, 340)
set multiplot layout 1,3
set title 'one map as the light turns, f/n = 100'; set xlabel 'degrees from overhead to behind'; set ylabel 'S'
set xtics 0,15,90; set key bottom right
t = table('warps_against_light')
plot [0:90] t using 'degrees':'plain' with lines lc rgb grey title 'none', t using 'degrees':'psm' with lines lc rgb red title 'PSM', \
  t using 'degrees':'tsm' with lines lc rgb blue title 'TSM', t using 'degrees':'lispsm' with lines lc rgb green title 'LiSPSM'
unset logscale y; set xtics autofreq; set key top left
t = table('shadow_times')
set title 'shadow passes of relief'; set xlabel 'maps'; set ylabel 'ms'
plot [1:16] [0:*] t using 'maps':'whole_ms' with linespoints pt 6 ps 0.5 lc rgb red title 'every map whole', \
  t using 'maps':'culled_ms' with linespoints pt 6 ps 0.5 lc rgb green title 'culled'
set title 'triangles drawn'; set ylabel '× 10^6' norotate
plot [1:16] [0:*] t using 'maps':(column('whole_triangles') / 1e6) with linespoints pt 6 ps 0.5 lc rgb red notitle, \
  t using 'maps':(column('culled_triangles') / 1e6) with linespoints pt 6 ps 0.5 lc rgb green notitle
unset multiplot

# Fig. 7: storage over the hemisphere of lights.
set terminal pngcairo size 1000,270 font 'DejaVu Sans,9'
set output folder . '/lights.png'
set multiplot
unset grid; unset border; unset tics; unset key; unset xlabel; unset ylabel; unset colorbox
set size ratio -1
set palette defined (0 '#2c3e8f', 1 '#2e9e8f', 2 '#f4e04d', 3 '#e67e22', 4 '#9b1c1c')
set cbrange [1:6]
set label 1 'behind' at -1.05,-1.05 left font ',7'; set label 2 'in front' at 1.05,-1.05 right font ',7'
t = table('storage_over_lights')
array Scheme[4] = ["plain", "warped", "faces", "slices"]
array Title[4] = ["no warp", "W", "FP+W", "ZP4+W"]
do for [i=1:4] {
  set lmargin at screen 0.01 + 0.23 * (i - 1); set rmargin at screen 0.22 + 0.23 * (i - 1)
  set bmargin at screen 0.08; set tmargin at screen 0.86
  if (i == 4) { set colorbox user origin 0.94,0.12 size 0.012,0.7; set cbtics 1,1,6 scale 0; set cblabel 'log_{10} S' offset 1 }
  set title Title[i]
  plot [-1.1:1.1] [-1.1:1.1] t using 'x':'y':(log10(column(Scheme[i]))) with image
}
unset multiplot
