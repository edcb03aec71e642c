; Sources 2639d72187b2918dbff16475bd51279b01cbd8b80833b084118f22b0e69242ce
; Made by `python -m passgraph.backends.numpy.raster.generate`.

define internal i32 @project(ptr noalias %retptr, ptr noalias %excinfo, i64 %arg.first, i64 %arg.last, ptr noalias %arg.clip.0, ptr noalias %arg.clip.1, i64 %arg.clip.2, i64 %arg.clip.3, ptr noalias %arg.clip.4, i64 %arg.clip.5.0, i64 %arg.clip.5.1, i64 %arg.clip.6.0, i64 %arg.clip.6.1, i64 %arg.width, i64 %arg.height, ptr noalias %arg.window_x.0, ptr noalias %arg.window_x.1, i64 %arg.window_x.2, i64 %arg.window_x.3, ptr noalias %arg.window_x.4, i64 %arg.window_x.5.0, i64 %arg.window_x.6.0, ptr noalias %arg.window_y.0, ptr noalias %arg.window_y.1, i64 %arg.window_y.2, i64 %arg.window_y.3, ptr noalias %arg.window_y.4, i64 %arg.window_y.5.0, i64 %arg.window_y.6.0, ptr noalias %arg.depth.0, ptr noalias %arg.depth.1, i64 %arg.depth.2, i64 %arg.depth.3, ptr noalias %arg.depth.4, i64 %arg.depth.5.0, i64 %arg.depth.6.0, ptr noalias %arg.inverse_w.0, ptr noalias %arg.inverse_w.1, i64 %arg.inverse_w.2, i64 %arg.inverse_w.3, ptr noalias %arg.inverse_w.4, i64 %arg.inverse_w.5.0, i64 %arg.inverse_w.6.0, ptr noalias %arg.codes.0, ptr noalias %arg.codes.1, i64 %arg.codes.2, i64 %arg.codes.3, ptr noalias %arg.codes.4, i64 %arg.codes.5.0, i64 %arg.codes.6.0) {
entry:
  %.118 = sub i64 %arg.last, %arg.first
  %.164289.not = icmp slt i64 %.118, 1
  br i1 %.164289.not, label %B1056, label %B38.if.lr.ph

B38.if.lr.ph:
  %.666 = sitofp i64 %arg.width to double
  %.780 = sitofp i64 %arg.height to double
  br label %B38.if

B290:
  %.563 = tail call double @llvm.fabs.f64(double %.259)
  %.565 = fmul double %.424, 8.000000e+00
  %.566 = fcmp ugt double %.563, %.565
  %.573 = tail call double @llvm.fabs.f64(double %.314)
  %.576 = fcmp ugt double %.573, %.565
  %extract.t273 = trunc i64 %.553 to i8
  %or.cond = select i1 %.566, i1 true, i1 %.576
  br i1 %or.cond, label %B378, label %B398

B378:
  %.pre294.pre-phi = phi double [ %.pre, %B38.if.B378_crit_edge ], [ %.573, %B290 ]
  %.pre.pre-phi = phi double [ %.pre298, %B38.if.B378_crit_edge ], [ %.563, %B290 ]
  %.pre-phi297 = phi i8 [ %.pre296, %B38.if.B378_crit_edge ], [ %extract.t273, %B290 ]
  %extract.t274 = or i8 %.pre-phi297, 64
  br label %B398

B398:
  %.pre-phi295 = phi double [ %.573, %B290 ], [ %.pre294.pre-phi, %B378 ]
  %.pre-phi = phi double [ %.563, %B290 ], [ %.pre.pre-phi, %B378 ]
  %code.4.2.off0 = phi i8 [ %extract.t273, %B290 ], [ %extract.t274, %B378 ]
  %0 = fcmp ueq double %.pre-phi, 0x7FF0000000000000
  %1 = fcmp ueq double %.pre-phi295, 0x7FF0000000000000
  %or.cond276 = select i1 %0, i1 true, i1 %1
  %2 = tail call double @llvm.fabs.f64(double %.369)
  %3 = fcmp ueq double %2, 0x7FF0000000000000
  %or.cond278 = select i1 %or.cond276, i1 true, i1 %3
  %4 = tail call double @llvm.fabs.f64(double %.424)
  %5 = fcmp ueq double %4, 0x7FF0000000000000
  %or.cond280 = or i1 %or.cond278, %5
  %extract.t272 = or i8 %code.4.2.off0, -128
  %code.5.2.off0 = select i1 %or.cond280, i8 %extract.t272, i8 %code.4.2.off0
  %.632 = select i1 %.232, i64 %arg.codes.5.0, i64 0
  %6 = getelementptr i8, ptr %arg.codes.4, i64 %.105.0291
  %.646 = getelementptr i8, ptr %6, i64 %.632
  store i8 %code.5.2.off0, ptr %.646, align 1
  br i1 %.560, label %B672, label %B1052

B672:
  %.660 = fdiv double %.259, %.424
  %.663 = fmul double %.660, 5.000000e-01
  %.664 = fadd double %.663, 5.000000e-01
  %.667 = fmul double %.664, %.666
  %.668 = fmul double %.667, 2.560000e+02
  %.676.le = tail call double @llvm.rint.f64(double %.668)
  %.10.i = fcmp olt double %.676.le, -1.000000e+09
  %.11.i = select i1 %.10.i, double -1.000000e+09, double %.676.le
  %.10.i281 = fcmp ogt double %.11.i, 1.000000e+09
  %.11.i282 = select i1 %.10.i281, double 1.000000e+09, double %.11.i
  %.737 = fptosi double %.11.i282 to i32
  %.753 = select i1 %.232, i64 %arg.window_x.5.0, i64 0
  %7 = getelementptr i32, ptr %arg.window_x.4, i64 %.105.0291
  %.767 = getelementptr i32, ptr %7, i64 %.753
  store i32 %.737, ptr %.767, align 4
  %.774 = fdiv double %.314, %.424
  %.777 = fmul double %.774, 5.000000e-01
  %.778 = fsub double 5.000000e-01, %.777
  %.781 = fmul double %.778, %.780
  %.782 = fmul double %.781, 2.560000e+02
  %.790.le = tail call double @llvm.rint.f64(double %.782)
  %.10.i283 = fcmp olt double %.790.le, -1.000000e+09
  %.11.i284 = select i1 %.10.i283, double -1.000000e+09, double %.790.le
  %.10.i285 = fcmp ogt double %.11.i284, 1.000000e+09
  %.11.i286 = select i1 %.10.i285, double 1.000000e+09, double %.11.i284
  %.851 = fptosi double %.11.i286 to i32
  %.867 = select i1 %.232, i64 %arg.window_y.5.0, i64 0
  %8 = getelementptr i32, ptr %arg.window_y.4, i64 %.105.0291
  %.881 = getelementptr i32, ptr %8, i64 %.867
  store i32 %.851, ptr %.881, align 4
  %.888 = fdiv double %.369, %.424
  %.891 = fmul double %.888, 5.000000e-01
  %.892 = fadd double %.891, 5.000000e-01
  %.908 = select i1 %.232, i64 %arg.depth.5.0, i64 0
  %9 = getelementptr double, ptr %arg.depth.4, i64 %.105.0291
  %.922 = getelementptr double, ptr %9, i64 %.908
  store double %.892, ptr %.922, align 8
  %.928 = fdiv double 1.000000e+00, %.424
  %.946 = select i1 %.232, i64 %arg.inverse_w.5.0, i64 0
  %10 = getelementptr double, ptr %arg.inverse_w.4, i64 %.105.0291
  %.960 = getelementptr double, ptr %10, i64 %.946
  store double %.928, ptr %.960, align 8
  br label %B1052

B1052:
  %.164 = icmp ugt i64 %.108.0290, 1
  br i1 %.164, label %B38.if, label %B1056

B1056:
  store ptr null, ptr %retptr, align 8
  ret i32 0

B38.if:
  %.105.0291 = phi i64 [ %arg.first, %B38.if.lr.ph ], [ %.177, %B1052 ]
  %.108.0290 = phi i64 [ %.118, %B38.if.lr.ph ], [ %.173, %B1052 ]
  %.173 = add nsw i64 %.108.0290, -1
  %.177 = add i64 %.105.0291, 1
  %.232 = icmp slt i64 %.105.0291, 0
  %.233 = select i1 %.232, i64 %arg.clip.5.0, i64 0
  %.234 = add i64 %.233, %.105.0291
  %.254 = mul i64 %.234, %arg.clip.5.1
  %.258 = getelementptr double, ptr %arg.clip.4, i64 %.254
  %.259 = load double, ptr %.258, align 8
  %.313 = getelementptr i8, ptr %.258, i64 8
  %.314 = load double, ptr %.313, align 8
  %.368 = getelementptr i8, ptr %.258, i64 16
  %.369 = load double, ptr %.368, align 8
  %.423 = getelementptr i8, ptr %.258, i64 24
  %.424 = load double, ptr %.423, align 8
  %.447 = fadd double %.369, %.424
  %.448 = fcmp ult double %.447, 0.000000e+00
  %. = zext i1 %.448 to i64
  %.459 = fsub double %.424, %.369
  %.460 = fcmp ult double %.459, 0.000000e+00
  %"$phi176.2.2.1" = select i1 %.460, i64 2, i64 0
  %.478 = fcmp ogt double %.259, %.424
  %"$phi222.2.2.1" = select i1 %.478, i64 4, i64 0
  %.491 = fneg double %.424
  %.493 = fcmp olt double %.259, %.491
  %"$phi222.3.2.1" = select i1 %.493, i64 8, i64 0
  %.504 = or i64 %"$phi222.2.2.1", %"$phi222.3.2.1"
  %.511 = fcmp ogt double %.314, %.424
  %"$phi244.3.2.1" = select i1 %.511, i64 16, i64 0
  %.525 = or i64 %.504, %"$phi244.3.2.1"
  %.533 = fcmp olt double %.314, %.491
  %"$phi268.3.2.1" = select i1 %.533, i64 32, i64 0
  %.547 = or i64 %.525, %"$phi268.3.2.1"
  %.471 = or i64 %.547, %.
  %.553 = or i64 %.471, %"$phi176.2.2.1"
  %.560 = fcmp ogt double %.424, 0.000000e+00
  br i1 %.560, label %B290, label %B38.if.B378_crit_edge

B38.if.B378_crit_edge:
  %.pre296 = trunc i64 %.553 to i8
  %.pre298 = tail call double @llvm.fabs.f64(double %.259)
  %.pre = tail call double @llvm.fabs.f64(double %.314)
  br label %B378
}

declare double @llvm.fabs.f64(double)

declare double @llvm.rint.f64(double)
