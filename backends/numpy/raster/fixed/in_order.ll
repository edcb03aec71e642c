; Sources 2639d72187b2918dbff16475bd51279b01cbd8b80833b084118f22b0e69242ce
; Made by `python -m passgraph.backends.numpy.raster.generate`.

define internal i32 @in_order(ptr noalias %retptr, ptr noalias %excinfo, ptr noalias %arg.counter.0, ptr noalias %arg.counter.1, i64 %arg.counter.2, i64 %arg.counter.3, ptr noalias %arg.counter.4, i64 %arg.counter.5.0, i64 %arg.counter.6.0, i64 %arg.count, ptr noalias %arg.busy.0, ptr noalias %arg.busy.1, i64 %arg.busy.2, i64 %arg.busy.3, ptr noalias %arg.busy.4, i64 %arg.busy.5.0, i64 %arg.busy.6.0, i64 %arg.tiles_x, ptr noalias %arg.offsets.0, ptr noalias %arg.offsets.1, i64 %arg.offsets.2, i64 %arg.offsets.3, ptr noalias %arg.offsets.4, i64 %arg.offsets.5.0, i64 %arg.offsets.6.0, ptr noalias %arg.lists.0, ptr noalias %arg.lists.1, i64 %arg.lists.2, i64 %arg.lists.3, ptr noalias %arg.lists.4, i64 %arg.lists.5.0, i64 %arg.lists.6.0, ptr noalias %arg.triangles.0, ptr noalias %arg.triangles.1, i64 %arg.triangles.2, i64 %arg.triangles.3, ptr noalias %arg.triangles.4, i64 %arg.triangles.5.0, i64 %arg.triangles.5.1, i64 %arg.triangles.6.0, i64 %arg.triangles.6.1, ptr noalias %arg.wx.0, ptr noalias %arg.wx.1, i64 %arg.wx.2, i64 %arg.wx.3, ptr noalias %arg.wx.4, i64 %arg.wx.5.0, i64 %arg.wx.6.0, ptr noalias %arg.wy.0, ptr noalias %arg.wy.1, i64 %arg.wy.2, i64 %arg.wy.3, ptr noalias %arg.wy.4, i64 %arg.wy.5.0, i64 %arg.wy.6.0, ptr noalias %arg.wz.0, ptr noalias %arg.wz.1, i64 %arg.wz.2, i64 %arg.wz.3, ptr noalias %arg.wz.4, i64 %arg.wz.5.0, i64 %arg.wz.6.0, ptr noalias %arg.iw.0, ptr noalias %arg.iw.1, i64 %arg.iw.2, i64 %arg.iw.3, ptr noalias %arg.iw.4, i64 %arg.iw.5.0, i64 %arg.iw.6.0, ptr noalias %arg.vary.0, ptr noalias %arg.vary.1, i64 %arg.vary.2, i64 %arg.vary.3, ptr noalias %arg.vary.4, i64 %arg.vary.5.0, i64 %arg.vary.5.1, i64 %arg.vary.6.0, i64 %arg.vary.6.1, double %arg.factor, double %arg.units, i64 %arg.width, i64 %arg.height, ptr noalias %arg.depth.0, ptr noalias %arg.depth.1, i64 %arg.depth.2, i64 %arg.depth.3, ptr noalias %arg.depth.4, i64 %arg.depth.5.0, i64 %arg.depth.6.0, double %arg.depth_clear, i64 %arg.clears, ptr noalias %arg.spans.0, ptr noalias %arg.spans.1, i64 %arg.spans.2, i64 %arg.spans.3, ptr noalias %arg.spans.4, i64 %arg.spans.5.0, i64 %arg.spans.6.0, i64 %arg.rows, ptr noalias %arg.table.0, ptr noalias %arg.table.1, i64 %arg.table.2, i64 %arg.table.3, ptr noalias %arg.table.4, i64 %arg.table.5.0, i64 %arg.table.6.0, i64 %arg.merge, ptr noalias %arg.context.0, ptr noalias %arg.context.1, i64 %arg.context.2, i64 %arg.context.3, ptr noalias %arg.context.4, i64 %arg.context.5.0, i64 %arg.context.6.0) {
entry:
  %.2041328 = atomicrmw add ptr %arg.counter.4, i64 1 monotonic, align 8
  %.210.not1329 = icmp slt i64 %.2041328, %arg.count
  br i1 %.210.not1329, label %B52.lr.ph, label %B48

B52.lr.ph:
  %.304 = icmp ne i64 %arg.tiles_x, 0
  %.316 = icmp ne i64 %arg.tiles_x, -1
  %0 = trunc i64 %arg.tiles_x to i32
  %.464 = fcmp ord double %arg.depth_clear, 0.000000e+00
  %.708 = fptrunc double %arg.depth_clear to float
  %.753.not = icmp eq i64 %arg.clears, 0
  %.781 = inttoptr i64 %arg.merge to ptr
  %.151.i = ptrtoint ptr %arg.triangles.4 to i64
  %.372.i = ptrtoint ptr %arg.wx.4 to i64
  %.388.i = ptrtoint ptr %arg.wy.4 to i64
  %.404.i = ptrtoint ptr %arg.wz.4 to i64
  %.422.i = ptrtoint ptr %arg.iw.4 to i64
  %.438.i = ptrtoint ptr %arg.vary.4 to i64
  %.588.i = getelementptr i8, ptr %arg.table.4, i64 8
  %.67.i.i = fcmp une double %arg.factor, 0.000000e+00
  %.74.i.i = fcmp une double %arg.units, 0.000000e+00
  %or.cond.i.i = select i1 %.67.i.i, i1 true, i1 %.74.i.i
  %.44.i.i = getelementptr i8, ptr %arg.table.4, i64 16
  %.71.i.i = getelementptr i8, ptr %arg.table.4, i64 24
  %.98.i.i = getelementptr i8, ptr %arg.table.4, i64 32
  %.745.i = icmp sgt i64 %arg.rows, 1
  %.44.i614.i = getelementptr i8, ptr %arg.table.4, i64 40
  %.71.i615.i = getelementptr i8, ptr %arg.table.4, i64 48
  %.98.i616.i = getelementptr i8, ptr %arg.table.4, i64 56
  %.44.i617.i = getelementptr i8, ptr %arg.table.4, i64 64
  %.71.i618.i = getelementptr i8, ptr %arg.table.4, i64 72
  %.98.i619.i = getelementptr i8, ptr %arg.table.4, i64 80
  %.44.i620.i = getelementptr i8, ptr %arg.table.4, i64 88
  %.71.i621.i = getelementptr i8, ptr %arg.table.4, i64 96
  %.98.i622.i = getelementptr i8, ptr %arg.table.4, i64 104
  %.1085624.not.i = icmp slt i64 %arg.vary.5.1, 1
  br label %B52

B6.loopexit:
  %.204 = atomicrmw add ptr %arg.counter.4, i64 1 monotonic, align 8
  %.210.not = icmp slt i64 %.204, %arg.count
  br i1 %.210.not, label %B52, label %B48

B48:
  store ptr null, ptr %retptr, align 8
  ret i32 0

B52:
  %.2041330 = phi i64 [ %.2041328, %B52.lr.ph ], [ %.204, %B6.loopexit ]
  %.278 = icmp slt i64 %.2041330, 0
  %.279 = select i1 %.278, i64 %arg.busy.5.0, i64 0
  %1 = getelementptr i64, ptr %arg.busy.4, i64 %.2041330
  %.293 = getelementptr i64, ptr %1, i64 %.279
  %.294 = load i64, ptr %.293, align 8
  %.315 = icmp ne i64 %.294, -9223372036854775808
  %.317.not = or i1 %.316, %.315
  %or.cond = select i1 %.304, i1 %.317.not, i1 false, !prof !0
  br i1 %or.cond, label %B52.else.if, label %B52.endif.endif, !prof !0

B228:
  %.504 = sub i64 %.11.i1253, %quot.1.0
  %.5471300.not = icmp slt i64 %.504, 1
  br i1 %.5471300.not, label %B398, label %B260.if.lr.ph

B260.if.lr.ph:
  %.626 = sub i64 %.11.i1252, %rem.01291
  %spec.select1295 = tail call i64 @llvm.smax.i64(i64 %.626, i64 0)
  %.6691297.not = icmp slt i64 %.626, 1
  br label %B260.if

B260.loopexit:
  %.547 = icmp ugt i64 %.494.01301, 1
  br i1 %.547, label %B260.if, label %B398

B398:
  br i1 %.753.not, label %B460, label %B410

B410:
  %.756 = add nsw i64 %.11.i1253, -1
  tail call void %.781(ptr %arg.context.4, ptr %arg.spans.4, ptr %arg.table.4, i64 %rem.01291, i64 %quot.1.0, i64 %.756, i64 1)
  br label %B460

B460:
  %.799 = icmp slt i64 %.294, -1
  %.800 = select i1 %.799, i64 %arg.offsets.5.0, i64 0
  %2 = getelementptr i64, ptr %arg.offsets.4, i64 %.294
  %3 = getelementptr i8, ptr %2, i64 8
  %.814 = getelementptr i64, ptr %3, i64 %.800
  %.815 = load i64, ptr %.814, align 8
  %.833 = icmp slt i64 %.294, 0
  %.834 = select i1 %.833, i64 %arg.offsets.5.0, i64 0
  %.848 = getelementptr i64, ptr %2, i64 %.834
  %.849 = load i64, ptr %.848, align 8
  %.889 = sub i64 %.815, %.849
  %.9331325.not = icmp slt i64 %.889, 1
  br i1 %.9331325.not, label %B6.loopexit, label %B528.if.lr.ph

B528.if.lr.ph:
  %.1636 = add nsw i64 %.11.i1252, -1
  %.1719 = add nsw i64 %.11.i1253, -1
  br label %B528.if

B1684:
  br i1 %.21101303.not, label %B1902, label %B1734.if

B1830.loopexit:
  %extract.t1333 = trunc i64 %first.4.4 to i32
  br label %B1902

B1832:
  %.27.i.i = icmp slt i64 %e0.2.21319, 0
  br i1 %.20.i.i, label %B16.i.i, label %B148.i.i

B16.i.i:
  br i1 %.27.i.i, label %B28.i.i, label %narrowed.2.exit.i

B28.i.i:
  %.30.i.i = sub i64 0, %e0.2.21319
  %.34.i.i = sitofp i64 %.30.i.i to double
  %.39.i.i = fdiv double %.34.i.i, %.35.i.i
  %.49.le.i.i = tail call double @llvm.ceil.f64(double %.39.i.i)
  %.54.i.i = fptosi double %.49.le.i.i to i64
  %.56.i.i = add nsw i64 %.11.i1260, %.54.i.i
  %.11.i.i.i = tail call i64 @llvm.smax.i64(i64 %.56.i.i, i64 %.11.i1260)
  br label %narrowed.2.exit.i

B148.i.i:
  %brmerge = select i1 %.27.i.i, i1 true, i1 %.144.i.i.not
  %.131.i.i.mux = select i1 %.27.i.i, i64 %.131.i.i, i64 %.11.i1262
  br i1 %brmerge, label %narrowed.2.exit.i, label %B184.i.i

B184.i.i:
  %.156.i.i = uitofp i64 %e0.2.21319 to double
  %.161.i.i = fdiv double %.156.i.i, %.157.i.i
  %.171.le.i.i = tail call double @llvm.floor.f64(double %.161.i.i)
  %.176.i.i = fptosi double %.171.le.i.i to i64
  %.178.i.i = add nsw i64 %.11.i1260, %.176.i.i
  %.11.i55.i.i = tail call i64 @llvm.smin.i64(i64 %.178.i.i, i64 %.11.i1262)
  br label %narrowed.2.exit.i

narrowed.2.exit.i:
  %first.2.0.i.i = phi i64 [ %.11.i1260, %B148.i.i ], [ %.11.i1260, %B16.i.i ], [ %.11.i1260, %B184.i.i ], [ %.11.i.i.i, %B28.i.i ]
  %last.3.0.i.i = phi i64 [ %.131.i.i.mux, %B148.i.i ], [ %.11.i1262, %B16.i.i ], [ %.11.i55.i.i, %B184.i.i ], [ %.11.i1262, %B28.i.i ]
  %.27.i16.i = icmp slt i64 %e1.2.21317, 0
  br i1 %.20.i15.i, label %B16.i34.i, label %B148.i17.i

B16.i34.i:
  br i1 %.27.i16.i, label %B28.i35.i, label %narrowed.2.exit44.i

B28.i35.i:
  %.30.i36.i = sub i64 0, %e1.2.21317
  %.34.i37.i = sitofp i64 %.30.i36.i to double
  %.39.i39.i = fdiv double %.34.i37.i, %.35.i38.i
  %.49.le.i40.i = tail call double @llvm.ceil.f64(double %.39.i39.i)
  %.54.i41.i = fptosi double %.49.le.i40.i to i64
  %.56.i42.i = add nsw i64 %.11.i1260, %.54.i41.i
  %.11.i.i43.i = tail call i64 @llvm.smax.i64(i64 %.56.i42.i, i64 %first.2.0.i.i)
  br label %narrowed.2.exit44.i

B148.i17.i:
  br i1 %.27.i16.i, label %B160.i32.i, label %B172.i18.i

B160.i32.i:
  %.131.i33.i = add nsw i64 %first.2.0.i.i, -1
  br label %narrowed.2.exit44.i

B172.i18.i:
  br i1 %.144.i19.i, label %B184.i23.i, label %narrowed.2.exit44.i

B184.i23.i:
  %.156.i25.i = uitofp i64 %e1.2.21317 to double
  %.161.i27.i = fdiv double %.156.i25.i, %.157.i26.i
  %.171.le.i28.i = tail call double @llvm.floor.f64(double %.161.i27.i)
  %.176.i29.i = fptosi double %.171.le.i28.i to i64
  %.178.i30.i = add nsw i64 %.11.i1260, %.176.i29.i
  %.11.i55.i31.i = tail call i64 @llvm.smin.i64(i64 %.178.i30.i, i64 %last.3.0.i.i)
  br label %narrowed.2.exit44.i

narrowed.2.exit44.i:
  %first.2.0.i20.i = phi i64 [ %first.2.0.i.i, %B172.i18.i ], [ %first.2.0.i.i, %B160.i32.i ], [ %first.2.0.i.i, %B184.i23.i ], [ %.11.i.i43.i, %B28.i35.i ], [ %first.2.0.i.i, %B16.i34.i ]
  %last.3.0.i21.i = phi i64 [ %last.3.0.i.i, %B172.i18.i ], [ %.131.i33.i, %B160.i32.i ], [ %.11.i55.i31.i, %B184.i23.i ], [ %last.3.0.i.i, %B28.i35.i ], [ %last.3.0.i.i, %B16.i34.i ]
  %.27.i46.i = icmp slt i64 %e2.2.21315, 0
  br i1 %.20.i45.i, label %B16.i64.i, label %B148.i47.i

B16.i64.i:
  br i1 %.27.i46.i, label %B28.i65.i, label %span.2.exit

B28.i65.i:
  %.30.i66.i = sub i64 0, %e2.2.21315
  %.34.i67.i = sitofp i64 %.30.i66.i to double
  %.39.i69.i = fdiv double %.34.i67.i, %.35.i68.i
  %.49.le.i70.i = tail call double @llvm.ceil.f64(double %.39.i69.i)
  %.54.i71.i = fptosi double %.49.le.i70.i to i64
  %.56.i72.i = add nsw i64 %.11.i1260, %.54.i71.i
  %.11.i.i73.i = tail call i64 @llvm.smax.i64(i64 %.56.i72.i, i64 %first.2.0.i20.i)
  br label %span.2.exit

B148.i47.i:
  br i1 %.27.i46.i, label %B160.i62.i, label %B172.i48.i

B160.i62.i:
  %.131.i63.i = add nsw i64 %first.2.0.i20.i, -1
  br label %span.2.exit

B172.i48.i:
  br i1 %.144.i49.i, label %B184.i53.i, label %span.2.exit

B184.i53.i:
  %.156.i55.i = uitofp i64 %e2.2.21315 to double
  %.161.i57.i = fdiv double %.156.i55.i, %.157.i56.i
  %.171.le.i58.i = tail call double @llvm.floor.f64(double %.161.i57.i)
  %.176.i59.i = fptosi double %.171.le.i58.i to i64
  %.178.i60.i = add nsw i64 %.11.i1260, %.176.i59.i
  %.11.i55.i61.i = tail call i64 @llvm.smin.i64(i64 %.178.i60.i, i64 %last.3.0.i21.i)
  br label %span.2.exit

span.2.exit:
  %first.2.0.i50.i = phi i64 [ %first.2.0.i20.i, %B172.i48.i ], [ %first.2.0.i20.i, %B160.i62.i ], [ %first.2.0.i20.i, %B184.i53.i ], [ %.11.i.i73.i, %B28.i65.i ], [ %first.2.0.i20.i, %B16.i64.i ]
  %last.3.0.i51.i = phi i64 [ %last.3.0.i21.i, %B172.i48.i ], [ %.131.i63.i, %B160.i62.i ], [ %.11.i55.i61.i, %B184.i53.i ], [ %last.3.0.i21.i, %B28.i65.i ], [ %last.3.0.i21.i, %B16.i64.i ]
  %.2312.not = icmp sgt i64 %first.2.0.i50.i, %last.3.0.i51.i
  %extract.t1246 = trunc i64 %first.2.0.i50.i to i32
  %spec.select = select i1 %.2312.not, i64 -1, i64 %last.3.0.i51.i
  %spec.select1248 = select i1 %.2312.not, i32 1073741824, i32 %extract.t1246
  br label %B1902

B1902:
  %last.3.3 = phi i64 [ %spec.select, %span.2.exit ], [ -1, %B1684 ], [ %last.5.4, %B1830.loopexit ]
  %first.5.3.off0 = phi i32 [ %spec.select1248, %span.2.exit ], [ 1073741824, %B1684 ], [ %extract.t1333, %B1830.loopexit ]
  %.2330 = icmp sgt i64 %last.3.3, -1
  %.2332 = or i1 %seen.2.21321, %.2330
  %.2362 = getelementptr i32, ptr %arg.spans.4, i64 %.1895.01313
  store i32 %first.5.3.off0, ptr %.2362, align 4
  %.2397 = getelementptr i8, ptr %.2362, i64 268
  %.2398 = trunc i64 %last.3.3 to i32
  store i32 %.2398, ptr %.2397, align 4
  %.2405 = add nsw i64 %e0.2.21319, %.2403
  %.2411 = add nsw i64 %e1.2.21317, %.2409
  %.2415 = sub nsw i64 %e2.2.21315, %.2413
  %.1952 = icmp ugt i64 %.1898.01314, 1
  br i1 %.1952, label %B1562.if, label %B2088

B2088:
  br i1 %.2332, label %B2148.if, label %B2370

B2274:
  tail call void @llvm.experimental.noalias.scope.decl(metadata !1)
  tail call void @llvm.experimental.noalias.scope.decl(metadata !4)
  tail call void @llvm.experimental.noalias.scope.decl(metadata !6)
  tail call void @llvm.experimental.noalias.scope.decl(metadata !8)
  tail call void @llvm.experimental.noalias.scope.decl(metadata !10)
  %.457.i = mul nsw i64 %.19.i, %.13.i
  %.460.i = mul nsw i64 %.17.i, %.15.i
  %.461.i = sub nsw i64 %.457.i, %.460.i
  %.462.i = sitofp i64 %.461.i to double
  %.466.i = sitofp i32 %.1240 to double
  %.470.i = fmul double %.466.i, 3.906250e-03
  %.471.i = fsub double 5.000000e-01, %.470.i
  %.478.i = sitofp i32 %.1267 to double
  %.482.i = fmul double %.478.i, 3.906250e-03
  %.483.i = fsub double 5.000000e-01, %.482.i
  store double %.483.i, ptr %arg.table.4, align 8, !alias.scope !10, !noalias !12
  %.560.i = getelementptr i8, ptr %.1104, i64 12
  %.561.i = load i32, ptr %.560.i, align 4, !alias.scope !1, !noalias !16
  %.589.i = sitofp i32 %.561.i to double
  store double %.589.i, ptr %.588.i, align 8, !alias.scope !10, !noalias !12
  %.621.i = getelementptr double, ptr %arg.wz.4, i64 %.1106
  %.622.i = load double, ptr %.621.i, align 8, !alias.scope !4, !noalias !17
  %.648.i = getelementptr double, ptr %arg.wz.4, i64 %.1159
  %.649.i = load double, ptr %.648.i, align 8, !alias.scope !4, !noalias !17
  %.675.i = getelementptr double, ptr %arg.wz.4, i64 %.1212
  %.676.i = load double, ptr %.675.i, align 8, !alias.scope !4, !noalias !17
  %.681.i = fdiv double 2.560000e+02, %.462.i
  %.12.i.i.i = fsub double %.649.i, %.622.i
  %.13.i.i.i = sitofp i64 %.19.i to double
  %.14.i.i.i = fmul double %.12.i.i.i, %.13.i.i.i
  %.15.i.i.i = fsub double %.676.i, %.622.i
  %.16.i.i.i = sitofp i64 %.15.i to double
  %.17.i.i.i = fmul double %.15.i.i.i, %.16.i.i.i
  %.18.i.i.i = fsub double %.14.i.i.i, %.17.i.i.i
  %.19.i.i.i = fmul double %.681.i, %.18.i.i.i
  %.21.i.i.i = sitofp i64 %.13.i to double
  %.22.i.i.i = fmul double %.15.i.i.i, %.21.i.i.i
  %.24.i.i.i = sitofp i64 %.17.i to double
  %.25.i.i.i = fmul double %.12.i.i.i, %.24.i.i.i
  %.26.i.i.i = fsub double %.22.i.i.i, %.25.i.i.i
  %.27.i.i.i = fmul double %.681.i, %.26.i.i.i
  br i1 %or.cond.i.i, label %B80.i.i, label %depth_plane.2.exit.i

B80.i.i:
  %.79.i.i = tail call double @llvm.fabs.f64(double %.622.i)
  %.83.i.i = tail call double @llvm.fabs.f64(double %.649.i)
  %.87.i.i = tail call double @llvm.fabs.f64(double %.676.i)
  %.13.i10.i.i = fcmp ogt double %.83.i.i, %.79.i.i
  %.14.i11.i.i = select i1 %.13.i10.i.i, double %.83.i.i, double %.79.i.i
  %.15.i12.i.i = fcmp ogt double %.87.i.i, %.14.i11.i.i
  %.16.i13.i.i = select i1 %.15.i12.i.i, double %.87.i.i, double %.14.i11.i.i
  %.124.i.i = fcmp ogt double %.16.i13.i.i, 0.000000e+00
  br i1 %.124.i.i, label %for.body.i.i, label %B294.i.i

B294.i.i:
  %"$phi294.0.2.0.i.i" = phi double [ %exp2.i.i, %for.body.i.i ], [ 0.000000e+00, %B80.i.i ]
  %.168.i.i = tail call double @llvm.fabs.f64(double %.19.i.i.i)
  %.170.i.i = tail call double @llvm.fabs.f64(double %.27.i.i.i)
  %.10.i.i.i = fcmp ogt double %.170.i.i, %.168.i.i
  %.11.i.i.i1251 = select i1 %.10.i.i.i, double %.170.i.i, double %.168.i.i
  %.200.i.i = fmul double %arg.factor, %.11.i.i.i1251
  %.204.i.i = fmul double %arg.units, %"$phi294.0.2.0.i.i"
  %.207.i.i = fadd double %.200.i.i, %.204.i.i
  %.209.i.i = fadd double %.622.i, %.207.i.i
  br label %depth_plane.2.exit.i

for.body.i.i:
  %.134.le.i.i = tail call double @llvm.log2.f64(double %.16.i13.i.i)
  %.148.le.i.i = tail call double @llvm.floor.f64(double %.134.le.i.i)
  %.153.i.i = fadd double %.148.le.i.i, -2.300000e+01
  %exp2.i.i = tail call double @llvm.exp2.f64(double %.153.i.i)
  br label %B294.i.i

depth_plane.2.exit.i:
  %start.2.1.i.i = phi double [ %.209.i.i, %B294.i.i ], [ %.622.i, %B2274 ]
  %.715.i = fmul double %.471.i, %.19.i.i.i
  %.716.i = fadd double %.715.i, %start.2.1.i.i
  store double %.716.i, ptr %.44.i.i, align 8, !alias.scope !18, !noalias !21
  store double %.19.i.i.i, ptr %.71.i.i, align 8, !alias.scope !18, !noalias !21
  store double %.27.i.i.i, ptr %.98.i.i, align 8, !alias.scope !18, !noalias !21
  br i1 %.745.i, label %B846.i, label %numbered.2.exit

B846.i:
  %.750.i = fmul double %.13.i.i.i, 2.560000e+02
  %.752.i = fmul double %.471.i, %.750.i
  %.753.i = fadd double %.752.i, 0.000000e+00
  %.761.i = fmul double %.24.i.i.i, -2.560000e+02
  store double %.753.i, ptr %.44.i614.i, align 8, !alias.scope !23, !noalias !26
  store double %.750.i, ptr %.71.i615.i, align 8, !alias.scope !23, !noalias !26
  store double %.761.i, ptr %.98.i616.i, align 8, !alias.scope !23, !noalias !26
  %.795.i = fmul double %.16.i.i.i, -2.560000e+02
  %.797.i = fmul double %.471.i, %.795.i
  %.800.i = fadd double %.797.i, 0.000000e+00
  %.808.i = fmul double %.21.i.i.i, 2.560000e+02
  store double %.800.i, ptr %.44.i617.i, align 8, !alias.scope !28, !noalias !31
  store double %.795.i, ptr %.71.i618.i, align 8, !alias.scope !28, !noalias !31
  store double %.808.i, ptr %.98.i619.i, align 8, !alias.scope !28, !noalias !31
  %.866.i = getelementptr double, ptr %arg.iw.4, i64 %.1159
  %.867.i = load double, ptr %.866.i, align 8, !alias.scope !6, !noalias !33
  %.894.i = getelementptr double, ptr %arg.iw.4, i64 %.1106
  %.895.i = load double, ptr %.894.i, align 8, !alias.scope !6, !noalias !33
  %.899.i = fdiv double %.867.i, %.895.i
  %.926.i = getelementptr double, ptr %arg.iw.4, i64 %.1212
  %.927.i = load double, ptr %.926.i, align 8, !alias.scope !6, !noalias !33
  %.961.i = fdiv double %.927.i, %.895.i
  store double %.462.i, ptr %.44.i620.i, align 8, !alias.scope !34, !noalias !37
  store double %.899.i, ptr %.71.i621.i, align 8, !alias.scope !34, !noalias !37
  store double %.961.i, ptr %.98.i622.i, align 8, !alias.scope !34, !noalias !37
  br i1 %.1085624.not.i, label %numbered.2.exit, label %B1168.if.lr.ph.i

B1168.if.lr.ph.i:
  %.1165.i = mul i64 %arg.vary.5.1, %.1106
  %4 = getelementptr float, ptr %arg.vary.4, i64 %.1165.i
  %.1215.i = mul i64 %arg.vary.5.1, %.1159
  %5 = getelementptr float, ptr %arg.vary.4, i64 %.1215.i
  %.1264.i = mul i64 %arg.vary.5.1, %.1212
  %6 = getelementptr float, ptr %arg.vary.4, i64 %.1264.i
  br label %B1168.if.i

B1168.if.i:
  %.1032.0626.i = phi i64 [ %arg.vary.5.1, %B1168.if.lr.ph.i ], [ %.1094.i, %B1168.if.i ]
  %.1029.0625.i = phi i64 [ 0, %B1168.if.lr.ph.i ], [ %.1098.i, %B1168.if.i ]
  %.1094.i = add nsw i64 %.1032.0626.i, -1
  %.1098.i = add nuw nsw i64 %.1029.0625.i, 1
  %.1169.i = getelementptr float, ptr %4, i64 %.1029.0625.i
  %.1170.i = load float, ptr %.1169.i, align 4, !alias.scope !8, !noalias !39
  %.1219.i = getelementptr float, ptr %5, i64 %.1029.0625.i
  %.1220.i = load float, ptr %.1219.i, align 4, !alias.scope !8, !noalias !39
  %.1221.i = fsub float %.1220.i, %.1170.i
  %.1268.i = getelementptr float, ptr %6, i64 %.1029.0625.i
  %.1269.i = load float, ptr %.1268.i, align 4, !alias.scope !8, !noalias !39
  %.1270.i = fsub float %.1269.i, %.1170.i
  %7 = mul i64 %.1029.0625.i, 24
  %8 = getelementptr i8, ptr %arg.table.4, i64 %7
  %.44.i623.i = getelementptr i8, ptr %8, i64 112
  %.45.i.i = fpext float %.1170.i to double
  store double %.45.i.i, ptr %.44.i623.i, align 8, !alias.scope !40, !noalias !43
  %.72.i.i = getelementptr i8, ptr %8, i64 120
  %.73.i.i = fpext float %.1221.i to double
  store double %.73.i.i, ptr %.72.i.i, align 8, !alias.scope !40, !noalias !43
  %.100.i.i = getelementptr i8, ptr %8, i64 128
  %.101.i.i = fpext float %.1270.i to double
  store double %.101.i.i, ptr %.100.i.i, align 8, !alias.scope !40, !noalias !43
  %.1085.i = icmp ugt i64 %.1032.0626.i, 1
  br i1 %.1085.i, label %B1168.if.i, label %numbered.2.exit

numbered.2.exit:
  tail call void %.781(ptr %arg.context.4, ptr %arg.spans.4, ptr %arg.table.4, i64 %rem.01291, i64 %.11.i1261, i64 %.11.i1263, i64 0)
  br label %B2370

B2370:
  %.933 = icmp sgt i64 %.879.01326, 1
  br i1 %.933, label %B528.if, label %B6.loopexit

B52.else.if:
  %9 = or i64 %.294, %arg.tiles_x
  %10 = icmp ult i64 %9, 4294967296
  br i1 %10, label %11, label %15

11:
  %12 = trunc i64 %.294 to i32
  %13 = urem i32 %12, %0
  %14 = zext i32 %13 to i64
  br label %B52.endif.else.if

15:
  %16 = srem i64 %.294, %arg.tiles_x
  br label %B52.endif.else.if

B52.endif.endif:
  %rem.01291 = phi i64 [ 0, %B52 ], [ %18, %30 ]
  %quot.1.0 = phi i64 [ 0, %B52 ], [ %33, %30 ]
  %.393 = add nsw i64 %rem.01291, 64
  %.11.i1252 = tail call i64 @llvm.smin.i64(i64 %.393, i64 %arg.width)
  %.426 = add nsw i64 %quot.1.0, 64
  %.11.i1253 = tail call i64 @llvm.smin.i64(i64 %.426, i64 %arg.height)
  br i1 %.464, label %B228, label %B398

B52.endif.else.if:
  %17 = phi i64 [ %14, %11 ], [ %16, %15 ]
  %.322 = xor i64 %17, %arg.tiles_x
  %.323 = icmp slt i64 %.322, 0
  %.324 = icmp ne i64 %17, 0
  %.325 = and i1 %.324, %.323
  %.332 = select i1 %.325, i64 %arg.tiles_x, i64 0
  %spec.select1249 = add i64 %.332, %17
  %18 = shl nsw i64 %spec.select1249, 6
  %19 = or i64 %.294, %arg.tiles_x
  %20 = icmp ult i64 %19, 4294967296
  br i1 %20, label %21, label %27

21:
  %22 = trunc i64 %.294 to i32
  %23 = udiv i32 %22, %0
  %24 = urem i32 %22, %0
  %25 = zext i32 %23 to i64
  %26 = zext i32 %24 to i64
  br label %30

27:
  %28 = sdiv i64 %.294, %arg.tiles_x
  %29 = srem i64 %.294, %arg.tiles_x
  br label %30

30:
  %31 = phi i64 [ %25, %21 ], [ %28, %27 ]
  %32 = phi i64 [ %26, %21 ], [ %29, %27 ]
  %.365 = xor i64 %32, %arg.tiles_x
  %.366 = icmp slt i64 %.365, 0
  %.367 = icmp ne i64 %32, 0
  %.368 = and i1 %.367, %.366
  %.373 = sext i1 %.368 to i64
  %spec.select1250 = add i64 %31, %.373
  %33 = shl nsw i64 %spec.select1250, 6
  br label %B52.endif.endif

B260.if:
  %.491.01302 = phi i64 [ %quot.1.0, %B260.if.lr.ph ], [ %.560, %B260.loopexit ]
  %.494.01301 = phi i64 [ %.504, %B260.if.lr.ph ], [ %.556, %B260.loopexit ]
  %.556 = add nsw i64 %.494.01301, -1
  %.560 = add i64 %.491.01302, 1
  br i1 %.6691297.not, label %B260.loopexit, label %B296.if.lr.ph

B296.if.lr.ph:
  %34 = mul nsw i64 %.491.01302, %arg.width
  %35 = getelementptr float, ptr %arg.depth.4, i64 %34
  br label %B296.if

B296.if:
  %.613.01299 = phi i64 [ %rem.01291, %B296.if.lr.ph ], [ %.682, %B296.if ]
  %.616.01298 = phi i64 [ %spec.select1295, %B296.if.lr.ph ], [ %.678, %B296.if ]
  %.678 = add nsw i64 %.616.01298, -1
  %.682 = add i64 %.613.01299, 1
  %.738 = getelementptr float, ptr %35, i64 %.613.01299
  store float %.708, ptr %.738, align 4
  %.669 = icmp sgt i64 %.616.01298, 1
  br i1 %.669, label %B296.if, label %B260.loopexit

B528.if:
  %.876.01327 = phi i64 [ %.849, %B528.if.lr.ph ], [ %.946, %B2370 ]
  %.879.01326 = phi i64 [ %.889, %B528.if.lr.ph ], [ %.942, %B2370 ]
  %.942 = add nsw i64 %.879.01326, -1
  %.946 = add i64 %.876.01327, 1
  tail call void @llvm.experimental.noalias.scope.decl(metadata !45)
  tail call void @llvm.experimental.noalias.scope.decl(metadata !48)
  %.107.i = add nsw i64 %.876.01327, 8
  %.108.i = icmp slt i64 %.107.i, %.815
  br i1 %.108.i, label %B40.i, label %soon.2.exit

B40.i:
  %.138.i = getelementptr i32, ptr %arg.lists.4, i64 %.107.i
  %.139.i = load i32, ptr %.138.i, align 4, !alias.scope !45, !noalias !50
  %.140.i = sext i32 %.139.i to i64
  %.152.i = mul i64 %arg.triangles.6.0, %.140.i
  %.153.i = add i64 %.152.i, %.151.i
  %.154.i = inttoptr i64 %.153.i to ptr
  tail call void @llvm.prefetch.p0(ptr %.154.i, i32 0, i32 3, i32 1), !noalias !57
  %36 = getelementptr i32, ptr %arg.lists.4, i64 %.876.01327
  %.185.i1254 = getelementptr i8, ptr %36, i64 16
  %.186.i1255 = load i32, ptr %.185.i1254, align 4, !alias.scope !45, !noalias !50
  %.189.i = sext i32 %.186.i1255 to i64
  %.351.i = mul i64 %arg.triangles.5.1, %.189.i
  %37 = getelementptr i32, ptr %arg.triangles.4, i64 %.351.i
  br label %B312.if.i

B312.if.i:
  %.219.0305.i = phi i64 [ 3, %B40.i ], [ %.283.i, %B312.if.i ]
  %.216.0304.i = phi i64 [ 0, %B40.i ], [ %.287.i, %B312.if.i ]
  %.283.i = add nsw i64 %.219.0305.i, -1
  %.287.i = add nuw nsw i64 %.216.0304.i, 1
  %.355.i1256 = getelementptr i32, ptr %37, i64 %.216.0304.i
  %.356.i1257 = load i32, ptr %.355.i1256, align 4, !alias.scope !48, !noalias !57
  %.357.i = sext i32 %.356.i1257 to i64
  %.373.i = mul i64 %arg.wx.6.0, %.357.i
  %.374.i = add i64 %.373.i, %.372.i
  %.375.i = inttoptr i64 %.374.i to ptr
  tail call void @llvm.prefetch.p0(ptr %.375.i, i32 0, i32 3, i32 1), !noalias !58
  %.389.i = mul i64 %arg.wy.6.0, %.357.i
  %.390.i = add i64 %.389.i, %.388.i
  %.391.i = inttoptr i64 %.390.i to ptr
  tail call void @llvm.prefetch.p0(ptr %.391.i, i32 0, i32 3, i32 1), !noalias !58
  %.405.i = mul i64 %arg.wz.6.0, %.357.i
  %.406.i = add i64 %.405.i, %.404.i
  %.407.i = inttoptr i64 %.406.i to ptr
  tail call void @llvm.prefetch.p0(ptr %.407.i, i32 0, i32 3, i32 1), !noalias !58
  %.423.i = mul i64 %arg.iw.6.0, %.357.i
  %.424.i = add i64 %.423.i, %.422.i
  %.425.i = inttoptr i64 %.424.i to ptr
  tail call void @llvm.prefetch.p0(ptr %.425.i, i32 0, i32 3, i32 1), !noalias !58
  %.439.i = mul i64 %arg.vary.6.0, %.357.i
  %.440.i = add i64 %.439.i, %.438.i
  %.441.i = inttoptr i64 %.440.i to ptr
  tail call void @llvm.prefetch.p0(ptr %.441.i, i32 0, i32 3, i32 1), !noalias !58
  %.274.i1258 = icmp ugt i64 %.219.0305.i, 1
  br i1 %.274.i1258, label %B312.if.i, label %soon.2.exit

soon.2.exit:
  %.1048 = getelementptr i32, ptr %arg.lists.4, i64 %.876.01327
  %.1049 = load i32, ptr %.1048, align 4
  %.1050 = sext i32 %.1049 to i64
  %.1100 = mul i64 %arg.triangles.5.1, %.1050
  %.1104 = getelementptr i32, ptr %arg.triangles.4, i64 %.1100
  %.1105 = load i32, ptr %.1104, align 4
  %.1106 = sext i32 %.1105 to i64
  %.1157 = getelementptr i8, ptr %.1104, i64 4
  %.1158 = load i32, ptr %.1157, align 4
  %.1159 = sext i32 %.1158 to i64
  %.1210 = getelementptr i8, ptr %.1104, i64 8
  %.1211 = load i32, ptr %.1210, align 4
  %.1212 = sext i32 %.1211 to i64
  %.1239 = getelementptr i32, ptr %arg.wx.4, i64 %.1106
  %.1240 = load i32, ptr %.1239, align 4
  %.1266 = getelementptr i32, ptr %arg.wy.4, i64 %.1106
  %.1267 = load i32, ptr %.1266, align 4
  %.1293 = getelementptr i32, ptr %arg.wx.4, i64 %.1159
  %.1294 = load i32, ptr %.1293, align 4
  %.1320 = getelementptr i32, ptr %arg.wy.4, i64 %.1159
  %.1321 = load i32, ptr %.1320, align 4
  %.1347 = getelementptr i32, ptr %arg.wx.4, i64 %.1212
  %.1348 = load i32, ptr %.1347, align 4
  %.1374 = getelementptr i32, ptr %arg.wy.4, i64 %.1212
  %.1375 = load i32, ptr %.1374, align 4
  %.10.i = sext i32 %.1240 to i64
  %.11.i1259 = sext i32 %.1267 to i64
  %.12.i = sext i32 %.1294 to i64
  %.13.i = sub nsw i64 %.12.i, %.10.i
  %.14.i = sext i32 %.1321 to i64
  %.15.i = sub nsw i64 %.14.i, %.11.i1259
  %.16.i = sext i32 %.1348 to i64
  %.17.i = sub nsw i64 %.16.i, %.10.i
  %.18.i = sext i32 %.1375 to i64
  %.19.i = sub nsw i64 %.18.i, %.11.i1259
  %.1462 = getelementptr i8, ptr %.1104, i64 16
  %.1463 = load i32, ptr %.1462, align 4
  %.1464 = sext i32 %.1463 to i64
  %.11.i1260 = tail call i64 @llvm.smax.i64(i64 %rem.01291, i64 %.1464)
  %.1544 = getelementptr i8, ptr %.1104, i64 20
  %.1545 = load i32, ptr %.1544, align 4
  %.1546 = sext i32 %.1545 to i64
  %.11.i1261 = tail call i64 @llvm.smax.i64(i64 %quot.1.0, i64 %.1546)
  %.1632 = getelementptr i8, ptr %.1104, i64 24
  %.1633 = load i32, ptr %.1632, align 4
  %.1634 = sext i32 %.1633 to i64
  %.11.i1262 = tail call i64 @llvm.smin.i64(i64 %.1636, i64 %.1634)
  %.1715 = getelementptr i8, ptr %.1104, i64 28
  %.1716 = load i32, ptr %.1715, align 4
  %.1717 = sext i32 %.1716 to i64
  %.11.i1263 = tail call i64 @llvm.smin.i64(i64 %.1719, i64 %.1717)
  %.neg = mul nsw i64 %.15.i, -256
  %.1852.neg = sub nsw i64 %.15.i, %.19.i
  %.1854 = shl nsw i64 %.1852.neg, 8
  %.1855 = shl nsw i64 %.19.i, 8
  %reass.sub1332 = sub i64 %.11.i1263, %.11.i1261
  %.1871 = add i64 %reass.sub1332, 1
  %.19521312.not = icmp ugt i64 %reass.sub1332, 9223372036854775806
  br i1 %.19521312.not, label %B2370, label %B1562.if.lr.ph

B1562.if.lr.ph:
  %invariant.op = add nsw i64 %.11.i1262, 1
  %.1755 = shl nsw i64 %.11.i1260, 8
  %reass.sub = sub i64 %.1755, %.10.i
  %.1757 = add i64 %reass.sub, 128
  %.21.neg.neg.i = sub i64 %.1757, %.17.i
  %.23.neg.i1283 = mul i64 %.21.neg.neg.i, %.19.i
  %.26.i1276 = icmp slt i64 %.19.i, 1
  %.32.i1277 = icmp ne i32 %.1375, %.1267
  %.37.i1278 = icmp sgt i64 %.17.i, -1
  %or.cond.not.i1279 = select i1 %.32.i1277, i1 true, i1 %.37.i1278
  %narrow.i1280 = select i1 %.26.i1276, i1 %or.cond.not.i1279, i1 false
  %"$phi98.1.2.0.neg.i1281" = sext i1 %narrow.i1280 to i64
  %.24.i1284 = add i64 %.23.neg.i1283, %"$phi98.1.2.0.neg.i1281"
  %.1759 = shl nsw i64 %.11.i1261, 8
  %reass.sub1331 = sub i64 %.1759, %.11.i1259
  %.1761 = add i64 %reass.sub1331, 128
  %.18.neg.i = sub i64 %.19.i, %.1761
  %.20.i1282 = mul i64 %.18.neg.i, %.17.i
  %.56.i1285 = add i64 %.24.i1284, %.20.i1282
  %.21.neg.i = sub i64 %.13.i, %.1757
  %.11.i1265 = sub nsw i64 %.19.i, %.15.i
  %.23.neg.i = mul i64 %.21.neg.i, %.11.i1265
  %.26.i1266 = icmp sgt i64 %.11.i1265, -1
  %.32.i1267 = icmp ne i32 %.1375, %.1321
  %.10.i1264 = sub nsw i64 %.17.i, %.13.i
  %.37.i1268 = icmp slt i64 %.10.i1264, 1
  %or.cond.not.i1269 = select i1 %.32.i1267, i1 true, i1 %.37.i1268
  %narrow.i1270 = select i1 %.26.i1266, i1 %or.cond.not.i1269, i1 false
  %"$phi98.1.2.0.neg.i1271" = sext i1 %narrow.i1270 to i64
  %.24.i1274 = add i64 %.23.neg.i, %"$phi98.1.2.0.neg.i1271"
  %.18.i1272 = sub nsw i64 %.1761, %.15.i
  %.20.i1273 = mul nsw i64 %.18.i1272, %.10.i1264
  %.56.i1275 = add i64 %.24.i1274, %.20.i1273
  %.26.i = icmp sgt i64 %.15.i, -1
  %.32.i = icmp ne i32 %.1321, %.1267
  %.37.i = icmp slt i64 %.13.i, 1
  %or.cond.not.i = select i1 %.32.i, i1 true, i1 %.37.i
  %narrow.i = select i1 %.26.i, i1 %or.cond.not.i, i1 false
  %"$phi98.1.2.0.neg.i" = sext i1 %narrow.i to i64
  %.23.i = mul nsw i64 %.1757, %.15.i
  %.24.i = sub i64 %"$phi98.1.2.0.neg.i", %.23.i
  %.20.i = mul nsw i64 %.1761, %.13.i
  %.56.i = add i64 %.24.i, %.20.i
  %.2001 = sub nsw i64 %.11.i1262, %.11.i1260
  %.2002 = icmp slt i64 %.2001, 8
  %.20.i.i = icmp slt i64 %.15.i, 0
  %.144.i.i.not = icmp eq i32 %.1321, %.1267
  %.152.i.i = sub nsw i64 0, %.neg
  %.157.i.i = sitofp i64 %.152.i.i to double
  %.131.i.i = add nsw i64 %.11.i1260, -1
  %.35.i.i = uitofp i64 %.neg to double
  %.20.i15.i = icmp sgt i64 %.1852.neg, 0
  %.144.i19.i = icmp slt i64 %.1852.neg, 0
  %.152.i24.i = sub nsw i64 0, %.1854
  %.157.i26.i = sitofp i64 %.152.i24.i to double
  %.35.i38.i = uitofp i64 %.1854 to double
  %.20.i45.i = icmp sgt i64 %.19.i, 0
  %.144.i49.i = icmp slt i64 %.19.i, 0
  %.152.i54.i = sub nsw i64 0, %.1855
  %.157.i56.i = sitofp i64 %.152.i54.i to double
  %.35.i68.i = uitofp i64 %.1855 to double
  %.2067.reass = sub i64 %invariant.op, %.11.i1260
  %spec.select1294 = tail call i64 @llvm.smax.i64(i64 %.2067.reass, i64 0)
  %.21101303.not = icmp slt i64 %.2067.reass, 1
  %.2403 = shl nsw i64 %.13.i, 8
  %.2409 = shl nsw i64 %.10.i1264, 8
  %.2413 = shl nsw i64 %.17.i, 8
  br label %B1562.if

B1562.if:
  %seen.2.21321 = phi i1 [ false, %B1562.if.lr.ph ], [ %.2332, %B1902 ]
  %e0.2.21319 = phi i64 [ %.56.i, %B1562.if.lr.ph ], [ %.2405, %B1902 ]
  %e1.2.21317 = phi i64 [ %.56.i1275, %B1562.if.lr.ph ], [ %.2411, %B1902 ]
  %e2.2.21315 = phi i64 [ %.56.i1285, %B1562.if.lr.ph ], [ %.2415, %B1902 ]
  %.1898.01314 = phi i64 [ %.1871, %B1562.if.lr.ph ], [ %.1961, %B1902 ]
  %.1895.01313 = phi i64 [ 0, %B1562.if.lr.ph ], [ %.1965, %B1902 ]
  %.1961 = add nsw i64 %.1898.01314, -1
  %.1965 = add nuw nsw i64 %.1895.01313, 1
  br i1 %.2002, label %B1684, label %B1832

B1734.if:
  %i0.2.31310 = phi i64 [ %.2222, %B1734.if ], [ %e0.2.21319, %B1684 ]
  %i1.2.31309 = phi i64 [ %.2225, %B1734.if ], [ %e1.2.21317, %B1684 ]
  %i2.2.31308 = phi i64 [ %.2228, %B1734.if ], [ %e2.2.21315, %B1684 ]
  %first.3.31307 = phi i64 [ %first.4.4, %B1734.if ], [ 1073741824, %B1684 ]
  %last.4.31306 = phi i64 [ %last.5.4, %B1734.if ], [ -1, %B1684 ]
  %.2057.01305 = phi i64 [ %.2119, %B1734.if ], [ %spec.select1294, %B1684 ]
  %.2054.01304 = phi i64 [ %.2123, %B1734.if ], [ %.11.i1260, %B1684 ]
  %.2119 = add nsw i64 %.2057.01305, -1
  %.2123 = add i64 %.2054.01304, 1
  %.2163 = or i64 %i1.2.31309, %i2.2.31308
  %.2165 = or i64 %.2163, %i0.2.31310
  %.2166 = icmp sgt i64 %.2165, -1
  %.11.i = tail call i64 @llvm.smin.i64(i64 %.2054.01304, i64 %first.3.31307)
  %last.5.4 = select i1 %.2166, i64 %.2054.01304, i64 %last.4.31306
  %first.4.4 = select i1 %.2166, i64 %.11.i, i64 %first.3.31307
  %.2222 = add nsw i64 %i0.2.31310, %.neg
  %.2225 = add nsw i64 %i1.2.31309, %.1854
  %.2228 = add nsw i64 %i2.2.31308, %.1855
  %.2110 = icmp sgt i64 %.2057.01305, 1
  br i1 %.2110, label %B1734.if, label %B1830.loopexit

B2148.if:
  %.2485.01324 = phi i64 [ %.2547, %B2148.if ], [ 3, %B2088 ]
  %.2482.01323 = phi i64 [ %.2551, %B2148.if ], [ %.1871, %B2088 ]
  %.2547 = add nsw i64 %.2485.01324, -1
  %.2551 = add i64 %.2482.01323, 1
  %.2601 = getelementptr i32, ptr %arg.spans.4, i64 %.2482.01323
  store i32 1073741824, ptr %.2601, align 4
  %.2630 = getelementptr i8, ptr %.2601, i64 268
  store i32 -1, ptr %.2630, align 4
  %.2538 = icmp ugt i64 %.2485.01324, 1
  br i1 %.2538, label %B2148.if, label %B2274
}

declare void @llvm.prefetch.p0(ptr, i32, i32, i32)

declare double @llvm.ceil.f64(double)

declare double @llvm.floor.f64(double)

declare double @llvm.fabs.f64(double)

declare double @llvm.log2.f64(double)

declare i64 @llvm.smin.i64(i64, i64)

declare i64 @llvm.smax.i64(i64, i64)

declare double @llvm.exp2.f64(double)

declare void @llvm.experimental.noalias.scope.decl(metadata)

!0 = !{!"branch_weights", i32 9801, i32 199}
!1 = !{!2}
!2 = distinct !{!2, !3, !"numbered.2: %arg.triangles.4"}
!3 = distinct !{!3, !"numbered.2"}
!4 = !{!5}
!5 = distinct !{!5, !3, !"numbered.2: %arg.depth.4"}
!6 = !{!7}
!7 = distinct !{!7, !3, !"numbered.2: %arg.inverse_w.4"}
!8 = !{!9}
!9 = distinct !{!9, !3, !"numbered.2: %arg.varyings.4"}
!10 = !{!11}
!11 = distinct !{!11, !3, !"numbered.2: %arg.table.4"}
!12 = !{!13, !2, !14, !15, !5, !7, !9}
!13 = distinct !{!13, !3, !"numbered.2: %retptr"}
!14 = distinct !{!14, !3, !"numbered.2: %arg.window_x.4"}
!15 = distinct !{!15, !3, !"numbered.2: %arg.window_y.4"}
!16 = !{!13, !14, !15, !5, !7, !9, !11}
!17 = !{!13, !2, !14, !15, !7, !9, !11}
!18 = !{!19, !11}
!19 = distinct !{!19, !20, !"put.8: %arg.table.4"}
!20 = distinct !{!20, !"put.8"}
!21 = !{!22, !13, !2, !14, !15, !5, !7, !9}
!22 = distinct !{!22, !20, !"put.8: %retptr"}
!23 = !{!24, !11}
!24 = distinct !{!24, !25, !"put.6: %arg.table.4"}
!25 = distinct !{!25, !"put.6"}
!26 = !{!27, !13, !2, !14, !15, !5, !7, !9}
!27 = distinct !{!27, !25, !"put.6: %retptr"}
!28 = !{!29, !11}
!29 = distinct !{!29, !30, !"put.9: %arg.table.4"}
!30 = distinct !{!30, !"put.9"}
!31 = !{!32, !13, !2, !14, !15, !5, !7, !9}
!32 = distinct !{!32, !30, !"put.9: %retptr"}
!33 = !{!13, !2, !14, !15, !5, !9, !11}
!34 = !{!35, !11}
!35 = distinct !{!35, !36, !"put.10: %arg.table.4"}
!36 = distinct !{!36, !"put.10"}
!37 = !{!38, !13, !2, !14, !15, !5, !7, !9}
!38 = distinct !{!38, !36, !"put.10: %retptr"}
!39 = !{!13, !2, !14, !15, !5, !7, !11}
!40 = !{!41, !11}
!41 = distinct !{!41, !42, !"put.7: %arg.table.4"}
!42 = distinct !{!42, !"put.7"}
!43 = !{!44, !13, !2, !14, !15, !5, !7, !9}
!44 = distinct !{!44, !42, !"put.7: %retptr"}
!45 = !{!46}
!46 = distinct !{!46, !47, !"soon.2: %arg.lists.4"}
!47 = distinct !{!47, !"soon.2"}
!48 = !{!49}
!49 = distinct !{!49, !47, !"soon.2: %arg.triangles.4"}
!50 = !{!51, !49, !52, !53, !54, !55, !56}
!51 = distinct !{!51, !47, !"soon.2: %retptr"}
!52 = distinct !{!52, !47, !"soon.2: %arg.window_x.4"}
!53 = distinct !{!53, !47, !"soon.2: %arg.window_y.4"}
!54 = distinct !{!54, !47, !"soon.2: %arg.depth.4"}
!55 = distinct !{!55, !47, !"soon.2: %arg.inverse_w.4"}
!56 = distinct !{!56, !47, !"soon.2: %arg.varyings.4"}
!57 = !{!51, !46, !52, !53, !54, !55, !56}
!58 = !{!51, !46}
