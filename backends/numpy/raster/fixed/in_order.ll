; Sources 8baf7d6345862153f6f93ce8dce036366c97b6cce981ca2dd97c93b19ca1195a
; Made by `python -m passgraph.backends.numpy.raster.generate`.

define internal i32 @in_order(ptr noalias %retptr, ptr noalias %excinfo, ptr noalias %arg.counter.0, ptr noalias %arg.counter.1, i64 %arg.counter.2, i64 %arg.counter.3, ptr noalias %arg.counter.4, i64 %arg.counter.5.0, i64 %arg.counter.6.0, i64 %arg.count, ptr noalias %arg.busy.0, ptr noalias %arg.busy.1, i64 %arg.busy.2, i64 %arg.busy.3, ptr noalias %arg.busy.4, i64 %arg.busy.5.0, i64 %arg.busy.6.0, i64 %arg.tiles_x, ptr noalias %arg.offsets.0, ptr noalias %arg.offsets.1, i64 %arg.offsets.2, i64 %arg.offsets.3, ptr noalias %arg.offsets.4, i64 %arg.offsets.5.0, i64 %arg.offsets.6.0, ptr noalias %arg.lists.0, ptr noalias %arg.lists.1, i64 %arg.lists.2, i64 %arg.lists.3, ptr noalias %arg.lists.4, i64 %arg.lists.5.0, i64 %arg.lists.6.0, ptr noalias %arg.made.0, ptr noalias %arg.made.1, i64 %arg.made.2, i64 %arg.made.3, ptr noalias %arg.made.4, i64 %arg.made.5.0, i64 %arg.made.5.1, i64 %arg.made.6.0, i64 %arg.made.6.1, ptr noalias %arg.wx.0, ptr noalias %arg.wx.1, i64 %arg.wx.2, i64 %arg.wx.3, ptr noalias %arg.wx.4, i64 %arg.wx.5.0, i64 %arg.wx.6.0, ptr noalias %arg.wy.0, ptr noalias %arg.wy.1, i64 %arg.wy.2, i64 %arg.wy.3, ptr noalias %arg.wy.4, i64 %arg.wy.5.0, i64 %arg.wy.6.0, ptr noalias %arg.wz.0, ptr noalias %arg.wz.1, i64 %arg.wz.2, i64 %arg.wz.3, ptr noalias %arg.wz.4, i64 %arg.wz.5.0, i64 %arg.wz.6.0, ptr noalias %arg.iw.0, ptr noalias %arg.iw.1, i64 %arg.iw.2, i64 %arg.iw.3, ptr noalias %arg.iw.4, i64 %arg.iw.5.0, i64 %arg.iw.6.0, ptr noalias %arg.vary.0, ptr noalias %arg.vary.1, i64 %arg.vary.2, i64 %arg.vary.3, ptr noalias %arg.vary.4, i64 %arg.vary.5.0, i64 %arg.vary.5.1, i64 %arg.vary.6.0, i64 %arg.vary.6.1, double %arg.factor, double %arg.units, i64 %arg.width, i64 %arg.height, ptr noalias %arg.depth.0, ptr noalias %arg.depth.1, i64 %arg.depth.2, i64 %arg.depth.3, ptr noalias %arg.depth.4, i64 %arg.depth.5.0, i64 %arg.depth.6.0, double %arg.depth_clear, i64 %arg.clears, ptr noalias %arg.spans.0, ptr noalias %arg.spans.1, i64 %arg.spans.2, i64 %arg.spans.3, ptr noalias %arg.spans.4, i64 %arg.spans.5.0, i64 %arg.spans.6.0, i64 %arg.rows, ptr noalias %arg.table.0, ptr noalias %arg.table.1, i64 %arg.table.2, i64 %arg.table.3, ptr noalias %arg.table.4, i64 %arg.table.5.0, i64 %arg.table.6.0, i64 %arg.merge, ptr noalias %arg.context.0, ptr noalias %arg.context.1, i64 %arg.context.2, i64 %arg.context.3, ptr noalias %arg.context.4, i64 %arg.context.5.0, i64 %arg.context.6.0) {
entry:
  %.2041325 = atomicrmw add ptr %arg.counter.4, i64 1 monotonic, align 8
  %.210.not1326 = icmp slt i64 %.2041325, %arg.count
  br i1 %.210.not1326, label %B52.lr.ph, label %B48

B52.lr.ph:
  %.304 = icmp ne i64 %arg.tiles_x, 0
  %.316 = icmp ne i64 %arg.tiles_x, -1
  %0 = trunc i64 %arg.tiles_x to i32
  %.464 = fcmp ord double %arg.depth_clear, 0.000000e+00
  %.708 = fptrunc double %arg.depth_clear to float
  %.753.not = icmp eq i64 %arg.clears, 0
  %.781 = inttoptr i64 %arg.merge to ptr
  %.154.i = ptrtoint ptr %arg.made.4 to i64
  %.388.i = ptrtoint ptr %arg.wx.4 to i64
  %.404.i = ptrtoint ptr %arg.wy.4 to i64
  %.420.i = ptrtoint ptr %arg.wz.4 to i64
  %.438.i = ptrtoint ptr %arg.iw.4 to i64
  %.454.i = ptrtoint ptr %arg.vary.4 to i64
  %.625.i = getelementptr i8, ptr %arg.table.4, i64 8
  %.67.i.i = fcmp une double %arg.factor, 0.000000e+00
  %.74.i.i = fcmp une double %arg.units, 0.000000e+00
  %or.cond.i.i = select i1 %.67.i.i, i1 true, i1 %.74.i.i
  %.44.i.i = getelementptr i8, ptr %arg.table.4, i64 16
  %.71.i.i = getelementptr i8, ptr %arg.table.4, i64 24
  %.98.i.i = getelementptr i8, ptr %arg.table.4, i64 32
  %.794.i = icmp sgt i64 %arg.rows, 1
  %.44.i614.i = getelementptr i8, ptr %arg.table.4, i64 40
  %.71.i615.i = getelementptr i8, ptr %arg.table.4, i64 48
  %.98.i616.i = getelementptr i8, ptr %arg.table.4, i64 56
  %.44.i617.i = getelementptr i8, ptr %arg.table.4, i64 64
  %.71.i618.i = getelementptr i8, ptr %arg.table.4, i64 72
  %.98.i619.i = getelementptr i8, ptr %arg.table.4, i64 80
  %.44.i620.i = getelementptr i8, ptr %arg.table.4, i64 88
  %.71.i621.i = getelementptr i8, ptr %arg.table.4, i64 96
  %.98.i622.i = getelementptr i8, ptr %arg.table.4, i64 104
  %.1150624.not.i = icmp slt i64 %arg.vary.5.1, 1
  br label %B52

B6.loopexit:
  %.204 = atomicrmw add ptr %arg.counter.4, i64 1 monotonic, align 8
  %.210.not = icmp slt i64 %.204, %arg.count
  br i1 %.210.not, label %B52, label %B48

B48:
  store ptr null, ptr %retptr, align 8
  ret i32 0

B52:
  %.2041327 = phi i64 [ %.2041325, %B52.lr.ph ], [ %.204, %B6.loopexit ]
  %.278 = icmp slt i64 %.2041327, 0
  %.279 = select i1 %.278, i64 %arg.busy.5.0, i64 0
  %1 = getelementptr i64, ptr %arg.busy.4, i64 %.2041327
  %.293 = getelementptr i64, ptr %1, i64 %.279
  %.294 = load i64, ptr %.293, align 8
  %.315 = icmp ne i64 %.294, -9223372036854775808
  %.317.not = or i1 %.316, %.315
  %or.cond = select i1 %.304, i1 %.317.not, i1 false, !prof !0
  br i1 %or.cond, label %B52.else.if, label %B52.endif.endif, !prof !0

B228:
  %.504 = sub i64 %.11.i1253, %quot.1.0
  %.5471297.not = icmp slt i64 %.504, 1
  br i1 %.5471297.not, label %B398, label %B260.if.lr.ph

B260.if.lr.ph:
  %.626 = sub i64 %.11.i1252, %rem.01288
  %spec.select1292 = tail call i64 @llvm.smax.i64(i64 %.626, i64 0)
  %.6691294.not = icmp slt i64 %.626, 1
  br label %B260.if

B260.loopexit:
  %.547 = icmp ugt i64 %.494.01298, 1
  br i1 %.547, label %B260.if, label %B398

B398:
  br i1 %.753.not, label %B460, label %B410

B410:
  %.756 = add nsw i64 %.11.i1253, -1
  tail call void %.781(ptr %arg.context.4, ptr %arg.spans.4, ptr %arg.table.4, i64 %rem.01288, i64 %quot.1.0, i64 %.756, i64 1)
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
  %.9331322.not = icmp slt i64 %.889, 1
  br i1 %.9331322.not, label %B6.loopexit, label %B528.if.lr.ph

B528.if.lr.ph:
  %.1683 = add nsw i64 %.11.i1252, -1
  %.1770 = add nsw i64 %.11.i1253, -1
  br label %B528.if

B1504:
  br i1 %.21611300.not, label %B1722, label %B1554.if

B1650.loopexit:
  %extract.t1330 = trunc i64 %first.4.4 to i32
  br label %B1722

B1652:
  %.27.i.i = icmp slt i64 %e0.2.21316, 0
  br i1 %.20.i.i, label %B16.i.i, label %B148.i.i

B16.i.i:
  br i1 %.27.i.i, label %B28.i.i, label %narrowed.2.exit.i

B28.i.i:
  %.30.i.i = sub i64 0, %e0.2.21316
  %.34.i.i = sitofp i64 %.30.i.i to double
  %.39.i.i = fdiv double %.34.i.i, %.35.i.i
  %.49.le.i.i = tail call double @llvm.ceil.f64(double %.39.i.i)
  %.54.i.i = fptosi double %.49.le.i.i to i64
  %.56.i.i = add nsw i64 %.11.i1257, %.54.i.i
  %.11.i.i.i = tail call i64 @llvm.smax.i64(i64 %.56.i.i, i64 %.11.i1257)
  br label %narrowed.2.exit.i

B148.i.i:
  %brmerge = select i1 %.27.i.i, i1 true, i1 %.144.i.i.not
  %.131.i.i.mux = select i1 %.27.i.i, i64 %.131.i.i, i64 %.11.i1259
  br i1 %brmerge, label %narrowed.2.exit.i, label %B184.i.i

B184.i.i:
  %.156.i.i = uitofp i64 %e0.2.21316 to double
  %.161.i.i = fdiv double %.156.i.i, %.157.i.i
  %.171.le.i.i = tail call double @llvm.floor.f64(double %.161.i.i)
  %.176.i.i = fptosi double %.171.le.i.i to i64
  %.178.i.i = add nsw i64 %.11.i1257, %.176.i.i
  %.11.i55.i.i = tail call i64 @llvm.smin.i64(i64 %.178.i.i, i64 %.11.i1259)
  br label %narrowed.2.exit.i

narrowed.2.exit.i:
  %first.2.0.i.i = phi i64 [ %.11.i1257, %B148.i.i ], [ %.11.i1257, %B16.i.i ], [ %.11.i1257, %B184.i.i ], [ %.11.i.i.i, %B28.i.i ]
  %last.3.0.i.i = phi i64 [ %.131.i.i.mux, %B148.i.i ], [ %.11.i1259, %B16.i.i ], [ %.11.i55.i.i, %B184.i.i ], [ %.11.i1259, %B28.i.i ]
  %.27.i16.i = icmp slt i64 %e1.2.21314, 0
  br i1 %.20.i15.i, label %B16.i34.i, label %B148.i17.i

B16.i34.i:
  br i1 %.27.i16.i, label %B28.i35.i, label %narrowed.2.exit44.i

B28.i35.i:
  %.30.i36.i = sub i64 0, %e1.2.21314
  %.34.i37.i = sitofp i64 %.30.i36.i to double
  %.39.i39.i = fdiv double %.34.i37.i, %.35.i38.i
  %.49.le.i40.i = tail call double @llvm.ceil.f64(double %.39.i39.i)
  %.54.i41.i = fptosi double %.49.le.i40.i to i64
  %.56.i42.i = add nsw i64 %.11.i1257, %.54.i41.i
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
  %.156.i25.i = uitofp i64 %e1.2.21314 to double
  %.161.i27.i = fdiv double %.156.i25.i, %.157.i26.i
  %.171.le.i28.i = tail call double @llvm.floor.f64(double %.161.i27.i)
  %.176.i29.i = fptosi double %.171.le.i28.i to i64
  %.178.i30.i = add nsw i64 %.11.i1257, %.176.i29.i
  %.11.i55.i31.i = tail call i64 @llvm.smin.i64(i64 %.178.i30.i, i64 %last.3.0.i.i)
  br label %narrowed.2.exit44.i

narrowed.2.exit44.i:
  %first.2.0.i20.i = phi i64 [ %first.2.0.i.i, %B172.i18.i ], [ %first.2.0.i.i, %B160.i32.i ], [ %first.2.0.i.i, %B184.i23.i ], [ %.11.i.i43.i, %B28.i35.i ], [ %first.2.0.i.i, %B16.i34.i ]
  %last.3.0.i21.i = phi i64 [ %last.3.0.i.i, %B172.i18.i ], [ %.131.i33.i, %B160.i32.i ], [ %.11.i55.i31.i, %B184.i23.i ], [ %last.3.0.i.i, %B28.i35.i ], [ %last.3.0.i.i, %B16.i34.i ]
  %.27.i46.i = icmp slt i64 %e2.2.21312, 0
  br i1 %.20.i45.i, label %B16.i64.i, label %B148.i47.i

B16.i64.i:
  br i1 %.27.i46.i, label %B28.i65.i, label %span.2.exit

B28.i65.i:
  %.30.i66.i = sub i64 0, %e2.2.21312
  %.34.i67.i = sitofp i64 %.30.i66.i to double
  %.39.i69.i = fdiv double %.34.i67.i, %.35.i68.i
  %.49.le.i70.i = tail call double @llvm.ceil.f64(double %.39.i69.i)
  %.54.i71.i = fptosi double %.49.le.i70.i to i64
  %.56.i72.i = add nsw i64 %.11.i1257, %.54.i71.i
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
  %.156.i55.i = uitofp i64 %e2.2.21312 to double
  %.161.i57.i = fdiv double %.156.i55.i, %.157.i56.i
  %.171.le.i58.i = tail call double @llvm.floor.f64(double %.161.i57.i)
  %.176.i59.i = fptosi double %.171.le.i58.i to i64
  %.178.i60.i = add nsw i64 %.11.i1257, %.176.i59.i
  %.11.i55.i61.i = tail call i64 @llvm.smin.i64(i64 %.178.i60.i, i64 %last.3.0.i21.i)
  br label %span.2.exit

span.2.exit:
  %first.2.0.i50.i = phi i64 [ %first.2.0.i20.i, %B172.i48.i ], [ %first.2.0.i20.i, %B160.i62.i ], [ %first.2.0.i20.i, %B184.i53.i ], [ %.11.i.i73.i, %B28.i65.i ], [ %first.2.0.i20.i, %B16.i64.i ]
  %last.3.0.i51.i = phi i64 [ %last.3.0.i21.i, %B172.i48.i ], [ %.131.i63.i, %B160.i62.i ], [ %.11.i55.i61.i, %B184.i53.i ], [ %last.3.0.i21.i, %B28.i65.i ], [ %last.3.0.i21.i, %B16.i64.i ]
  %.2363.not = icmp sgt i64 %first.2.0.i50.i, %last.3.0.i51.i
  %extract.t1246 = trunc i64 %first.2.0.i50.i to i32
  %spec.select = select i1 %.2363.not, i64 -1, i64 %last.3.0.i51.i
  %spec.select1248 = select i1 %.2363.not, i32 1073741824, i32 %extract.t1246
  br label %B1722

B1722:
  %last.3.3 = phi i64 [ %spec.select, %span.2.exit ], [ -1, %B1504 ], [ %last.5.4, %B1650.loopexit ]
  %first.5.3.off0 = phi i32 [ %spec.select1248, %span.2.exit ], [ 1073741824, %B1504 ], [ %extract.t1330, %B1650.loopexit ]
  %.2381 = icmp sgt i64 %last.3.3, -1
  %.2383 = or i1 %seen.2.21318, %.2381
  %.2413 = getelementptr i32, ptr %arg.spans.4, i64 %.1946.01310
  store i32 %first.5.3.off0, ptr %.2413, align 4
  %.2448 = getelementptr i8, ptr %.2413, i64 268
  %.2449 = trunc i64 %last.3.3 to i32
  store i32 %.2449, ptr %.2448, align 4
  %.2456 = add nsw i64 %e0.2.21316, %.2454
  %.2462 = add nsw i64 %e1.2.21314, %.2460
  %.2466 = sub nsw i64 %e2.2.21312, %.2464
  %.2003 = icmp ugt i64 %.1949.01311, 1
  br i1 %.2003, label %B1382.if, label %B1908

B1908:
  br i1 %.2383, label %B1968.if, label %B2190

B2094:
  tail call void @llvm.experimental.noalias.scope.decl(metadata !1)
  tail call void @llvm.experimental.noalias.scope.decl(metadata !4)
  tail call void @llvm.experimental.noalias.scope.decl(metadata !6)
  tail call void @llvm.experimental.noalias.scope.decl(metadata !8)
  tail call void @llvm.experimental.noalias.scope.decl(metadata !10)
  %.490.i = mul nsw i64 %.19.i, %.13.i
  %.493.i = mul nsw i64 %.17.i, %.15.i
  %.494.i = sub nsw i64 %.490.i, %.493.i
  %.495.i = sitofp i64 %.494.i to double
  %.499.i = sitofp i32 %.1255 to double
  %.503.i = fmul double %.499.i, 3.906250e-03
  %.504.i = fsub double 5.000000e-01, %.503.i
  %.511.i = sitofp i32 %.1286 to double
  %.515.i = fmul double %.511.i, 3.906250e-03
  %.516.i = fsub double 5.000000e-01, %.515.i
  store double %.516.i, ptr %arg.table.4, align 8, !alias.scope !10, !noalias !12
  %.597.i = getelementptr i8, ptr %.1110, i64 12
  %.598.i = load i32, ptr %.597.i, align 4, !alias.scope !1, !noalias !16
  %.626.i = sitofp i32 %.598.i to double
  store double %.626.i, ptr %.625.i, align 8, !alias.scope !10, !noalias !12
  %.648.i = select i1 %.1239, i64 %arg.wz.5.0, i64 0
  %4 = getelementptr double, ptr %arg.wz.4, i64 %.648.i
  %.662.i = getelementptr double, ptr %4, i64 %.1226
  %.663.i = load double, ptr %.662.i, align 8, !alias.scope !4, !noalias !17
  %.679.i = select i1 %.1301, i64 %arg.wz.5.0, i64 0
  %5 = getelementptr double, ptr %arg.wz.4, i64 %.679.i
  %.693.i = getelementptr double, ptr %5, i64 %.1288
  %.694.i = load double, ptr %.693.i, align 8, !alias.scope !4, !noalias !17
  %.710.i = select i1 %.1363, i64 %arg.wz.5.0, i64 0
  %6 = getelementptr double, ptr %arg.wz.4, i64 %.710.i
  %.724.i = getelementptr double, ptr %6, i64 %.1350
  %.725.i = load double, ptr %.724.i, align 8, !alias.scope !4, !noalias !17
  %.730.i = fdiv double 2.560000e+02, %.495.i
  %.12.i.i.i = fsub double %.694.i, %.663.i
  %.13.i.i.i = sitofp i64 %.19.i to double
  %.14.i.i.i = fmul double %.12.i.i.i, %.13.i.i.i
  %.15.i.i.i = fsub double %.725.i, %.663.i
  %.16.i.i.i = sitofp i64 %.15.i to double
  %.17.i.i.i = fmul double %.15.i.i.i, %.16.i.i.i
  %.18.i.i.i = fsub double %.14.i.i.i, %.17.i.i.i
  %.19.i.i.i = fmul double %.730.i, %.18.i.i.i
  %.21.i.i.i = sitofp i64 %.13.i to double
  %.22.i.i.i = fmul double %.15.i.i.i, %.21.i.i.i
  %.24.i.i.i = sitofp i64 %.17.i to double
  %.25.i.i.i = fmul double %.12.i.i.i, %.24.i.i.i
  %.26.i.i.i = fsub double %.22.i.i.i, %.25.i.i.i
  %.27.i.i.i = fmul double %.730.i, %.26.i.i.i
  br i1 %or.cond.i.i, label %B80.i.i, label %depth_plane.2.exit.i

B80.i.i:
  %.79.i.i = tail call double @llvm.fabs.f64(double %.663.i)
  %.83.i.i = tail call double @llvm.fabs.f64(double %.694.i)
  %.87.i.i = tail call double @llvm.fabs.f64(double %.725.i)
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
  %.209.i.i = fadd double %.663.i, %.207.i.i
  br label %depth_plane.2.exit.i

for.body.i.i:
  %.134.le.i.i = tail call double @llvm.log2.f64(double %.16.i13.i.i)
  %.148.le.i.i = tail call double @llvm.floor.f64(double %.134.le.i.i)
  %.153.i.i = fadd double %.148.le.i.i, -2.300000e+01
  %exp2.i.i = tail call double @llvm.exp2.f64(double %.153.i.i)
  br label %B294.i.i

depth_plane.2.exit.i:
  %start.2.1.i.i = phi double [ %.209.i.i, %B294.i.i ], [ %.663.i, %B2094 ]
  %.764.i = fmul double %.504.i, %.19.i.i.i
  %.765.i = fadd double %.764.i, %start.2.1.i.i
  store double %.765.i, ptr %.44.i.i, align 8, !alias.scope !18, !noalias !21
  store double %.19.i.i.i, ptr %.71.i.i, align 8, !alias.scope !18, !noalias !21
  store double %.27.i.i.i, ptr %.98.i.i, align 8, !alias.scope !18, !noalias !21
  br i1 %.794.i, label %B738.i, label %numbered.2.exit

B738.i:
  %.799.i = fmul double %.13.i.i.i, 2.560000e+02
  %.801.i = fmul double %.504.i, %.799.i
  %.802.i = fadd double %.801.i, 0.000000e+00
  %.810.i = fmul double %.24.i.i.i, -2.560000e+02
  store double %.802.i, ptr %.44.i614.i, align 8, !alias.scope !23, !noalias !26
  store double %.799.i, ptr %.71.i615.i, align 8, !alias.scope !23, !noalias !26
  store double %.810.i, ptr %.98.i616.i, align 8, !alias.scope !23, !noalias !26
  %.844.i = fmul double %.16.i.i.i, -2.560000e+02
  %.846.i = fmul double %.504.i, %.844.i
  %.849.i = fadd double %.846.i, 0.000000e+00
  %.857.i = fmul double %.21.i.i.i, 2.560000e+02
  store double %.849.i, ptr %.44.i617.i, align 8, !alias.scope !28, !noalias !31
  store double %.844.i, ptr %.71.i618.i, align 8, !alias.scope !28, !noalias !31
  store double %.857.i, ptr %.98.i619.i, align 8, !alias.scope !28, !noalias !31
  %.905.i = select i1 %.1301, i64 %arg.iw.5.0, i64 0
  %7 = getelementptr double, ptr %arg.iw.4, i64 %.905.i
  %.919.i = getelementptr double, ptr %7, i64 %.1288
  %.920.i = load double, ptr %.919.i, align 8, !alias.scope !6, !noalias !33
  %.937.i = select i1 %.1239, i64 %arg.iw.5.0, i64 0
  %8 = getelementptr double, ptr %arg.iw.4, i64 %.937.i
  %.951.i = getelementptr double, ptr %8, i64 %.1226
  %.952.i = load double, ptr %.951.i, align 8, !alias.scope !6, !noalias !33
  %.956.i = fdiv double %.920.i, %.952.i
  %.973.i = select i1 %.1363, i64 %arg.iw.5.0, i64 0
  %9 = getelementptr double, ptr %arg.iw.4, i64 %.973.i
  %.987.i = getelementptr double, ptr %9, i64 %.1350
  %.988.i = load double, ptr %.987.i, align 8, !alias.scope !6, !noalias !33
  %.1026.i = fdiv double %.988.i, %.952.i
  store double %.495.i, ptr %.44.i620.i, align 8, !alias.scope !34, !noalias !37
  store double %.956.i, ptr %.71.i621.i, align 8, !alias.scope !34, !noalias !37
  store double %.1026.i, ptr %.98.i622.i, align 8, !alias.scope !34, !noalias !37
  br i1 %.1150624.not.i, label %numbered.2.exit, label %B1060.if.lr.ph.i

B1060.if.lr.ph.i:
  %.1217.i = select i1 %.1239, i64 %arg.vary.5.0, i64 0
  %.1218.i = add i64 %.1217.i, %.1226
  %.1238.i = mul i64 %.1218.i, %arg.vary.5.1
  %10 = getelementptr float, ptr %arg.vary.4, i64 %.1238.i
  %.1275.i = select i1 %.1301, i64 %arg.vary.5.0, i64 0
  %.1276.i = add i64 %.1275.i, %.1288
  %.1296.i = mul i64 %.1276.i, %arg.vary.5.1
  %11 = getelementptr float, ptr %arg.vary.4, i64 %.1296.i
  %.1332.i = select i1 %.1363, i64 %arg.vary.5.0, i64 0
  %.1333.i = add i64 %.1332.i, %.1350
  %.1353.i = mul i64 %.1333.i, %arg.vary.5.1
  %12 = getelementptr float, ptr %arg.vary.4, i64 %.1353.i
  br label %B1060.if.i

B1060.if.i:
  %.1097.0626.i = phi i64 [ %arg.vary.5.1, %B1060.if.lr.ph.i ], [ %.1159.i, %B1060.if.i ]
  %.1094.0625.i = phi i64 [ 0, %B1060.if.lr.ph.i ], [ %.1163.i, %B1060.if.i ]
  %.1159.i = add nsw i64 %.1097.0626.i, -1
  %.1163.i = add nuw nsw i64 %.1094.0625.i, 1
  %.1242.i = getelementptr float, ptr %10, i64 %.1094.0625.i
  %.1243.i = load float, ptr %.1242.i, align 4, !alias.scope !8, !noalias !39
  %.1300.i = getelementptr float, ptr %11, i64 %.1094.0625.i
  %.1301.i = load float, ptr %.1300.i, align 4, !alias.scope !8, !noalias !39
  %.1302.i = fsub float %.1301.i, %.1243.i
  %.1357.i = getelementptr float, ptr %12, i64 %.1094.0625.i
  %.1358.i = load float, ptr %.1357.i, align 4, !alias.scope !8, !noalias !39
  %.1359.i = fsub float %.1358.i, %.1243.i
  %13 = mul i64 %.1094.0625.i, 24
  %14 = getelementptr i8, ptr %arg.table.4, i64 %13
  %.44.i623.i = getelementptr i8, ptr %14, i64 112
  %.45.i.i = fpext float %.1243.i to double
  store double %.45.i.i, ptr %.44.i623.i, align 8, !alias.scope !40, !noalias !43
  %.72.i.i = getelementptr i8, ptr %14, i64 120
  %.73.i.i = fpext float %.1302.i to double
  store double %.73.i.i, ptr %.72.i.i, align 8, !alias.scope !40, !noalias !43
  %.100.i.i = getelementptr i8, ptr %14, i64 128
  %.101.i.i = fpext float %.1359.i to double
  store double %.101.i.i, ptr %.100.i.i, align 8, !alias.scope !40, !noalias !43
  %.1150.i = icmp ugt i64 %.1097.0626.i, 1
  br i1 %.1150.i, label %B1060.if.i, label %numbered.2.exit

numbered.2.exit:
  tail call void %.781(ptr %arg.context.4, ptr %arg.spans.4, ptr %arg.table.4, i64 %rem.01288, i64 %.11.i1258, i64 %.11.i1260, i64 0)
  br label %B2190

B2190:
  %.933 = icmp sgt i64 %.879.01323, 1
  br i1 %.933, label %B528.if, label %B6.loopexit

B52.else.if:
  %15 = or i64 %.294, %arg.tiles_x
  %16 = icmp ult i64 %15, 4294967296
  br i1 %16, label %17, label %21

17:
  %18 = trunc i64 %.294 to i32
  %19 = urem i32 %18, %0
  %20 = zext i32 %19 to i64
  br label %B52.endif.else.if

21:
  %22 = srem i64 %.294, %arg.tiles_x
  br label %B52.endif.else.if

B52.endif.endif:
  %rem.01288 = phi i64 [ 0, %B52 ], [ %24, %36 ]
  %quot.1.0 = phi i64 [ 0, %B52 ], [ %39, %36 ]
  %.393 = add nsw i64 %rem.01288, 64
  %.11.i1252 = tail call i64 @llvm.smin.i64(i64 %.393, i64 %arg.width)
  %.426 = add nsw i64 %quot.1.0, 64
  %.11.i1253 = tail call i64 @llvm.smin.i64(i64 %.426, i64 %arg.height)
  br i1 %.464, label %B228, label %B398

B52.endif.else.if:
  %23 = phi i64 [ %20, %17 ], [ %22, %21 ]
  %.322 = xor i64 %23, %arg.tiles_x
  %.323 = icmp slt i64 %.322, 0
  %.324 = icmp ne i64 %23, 0
  %.325 = and i1 %.324, %.323
  %.332 = select i1 %.325, i64 %arg.tiles_x, i64 0
  %spec.select1249 = add i64 %.332, %23
  %24 = shl nsw i64 %spec.select1249, 6
  %25 = or i64 %.294, %arg.tiles_x
  %26 = icmp ult i64 %25, 4294967296
  br i1 %26, label %27, label %33

27:
  %28 = trunc i64 %.294 to i32
  %29 = udiv i32 %28, %0
  %30 = urem i32 %28, %0
  %31 = zext i32 %29 to i64
  %32 = zext i32 %30 to i64
  br label %36

33:
  %34 = sdiv i64 %.294, %arg.tiles_x
  %35 = srem i64 %.294, %arg.tiles_x
  br label %36

36:
  %37 = phi i64 [ %31, %27 ], [ %34, %33 ]
  %38 = phi i64 [ %32, %27 ], [ %35, %33 ]
  %.365 = xor i64 %38, %arg.tiles_x
  %.366 = icmp slt i64 %.365, 0
  %.367 = icmp ne i64 %38, 0
  %.368 = and i1 %.367, %.366
  %.373 = sext i1 %.368 to i64
  %spec.select1250 = add i64 %37, %.373
  %39 = shl nsw i64 %spec.select1250, 6
  br label %B52.endif.endif

B260.if:
  %.491.01299 = phi i64 [ %quot.1.0, %B260.if.lr.ph ], [ %.560, %B260.loopexit ]
  %.494.01298 = phi i64 [ %.504, %B260.if.lr.ph ], [ %.556, %B260.loopexit ]
  %.556 = add nsw i64 %.494.01298, -1
  %.560 = add i64 %.491.01299, 1
  br i1 %.6691294.not, label %B260.loopexit, label %B296.if.lr.ph

B296.if.lr.ph:
  %40 = mul nsw i64 %.491.01299, %arg.width
  %41 = getelementptr float, ptr %arg.depth.4, i64 %40
  br label %B296.if

B296.if:
  %.613.01296 = phi i64 [ %rem.01288, %B296.if.lr.ph ], [ %.682, %B296.if ]
  %.616.01295 = phi i64 [ %spec.select1292, %B296.if.lr.ph ], [ %.678, %B296.if ]
  %.678 = add nsw i64 %.616.01295, -1
  %.682 = add i64 %.613.01296, 1
  %.738 = getelementptr float, ptr %41, i64 %.613.01296
  store float %.708, ptr %.738, align 4
  %.669 = icmp sgt i64 %.616.01295, 1
  br i1 %.669, label %B296.if, label %B260.loopexit

B528.if:
  %.876.01324 = phi i64 [ %.849, %B528.if.lr.ph ], [ %.946, %B2190 ]
  %.879.01323 = phi i64 [ %.889, %B528.if.lr.ph ], [ %.942, %B2190 ]
  %.942 = add nsw i64 %.879.01323, -1
  %.946 = add i64 %.876.01324, 1
  tail call void @llvm.experimental.noalias.scope.decl(metadata !45)
  tail call void @llvm.experimental.noalias.scope.decl(metadata !48)
  %.107.i = add nsw i64 %.876.01324, 8
  %.108.i = icmp slt i64 %.107.i, %.815
  br i1 %.108.i, label %B38.i, label %soon.2.exit

B38.i:
  %.126.i = icmp slt i64 %.876.01324, -8
  %.127.i = select i1 %.126.i, i64 %arg.lists.5.0, i64 0
  %42 = getelementptr i32, ptr %arg.lists.4, i64 %.107.i
  %.141.i = getelementptr i32, ptr %42, i64 %.127.i
  %.142.i = load i32, ptr %.141.i, align 4, !alias.scope !45, !noalias !50
  %.143.i = sext i32 %.142.i to i64
  %.155.i = mul i64 %arg.made.6.0, %.143.i
  %.156.i = add i64 %.155.i, %.154.i
  %.157.i = inttoptr i64 %.156.i to ptr
  tail call void @llvm.prefetch.p0(ptr %.157.i, i32 0, i32 3, i32 1), !noalias !57
  %.176.i = icmp slt i64 %.876.01324, -4
  %.177.i = select i1 %.176.i, i64 %arg.lists.5.0, i64 0
  %43 = getelementptr i32, ptr %arg.lists.4, i64 %.876.01324
  %44 = getelementptr i8, ptr %43, i64 16
  %.191.i = getelementptr i32, ptr %44, i64 %.177.i
  %.192.i1254 = load i32, ptr %.191.i, align 4, !alias.scope !45, !noalias !50
  %.323.i = sext i32 %.192.i1254 to i64
  %.345.i = icmp slt i32 %.192.i1254, 0
  %.346.i = select i1 %.345.i, i64 %arg.made.5.0, i64 0
  %.347.i = add i64 %.346.i, %.323.i
  %.367.i = mul i64 %.347.i, %arg.made.5.1
  %45 = getelementptr i32, ptr %arg.made.4, i64 %.367.i
  br label %B202.if.i

B202.if.i:
  %.224.0305.i = phi i64 [ 3, %B38.i ], [ %.288.i1255, %B202.if.i ]
  %.221.0304.i = phi i64 [ 0, %B38.i ], [ %.292.i, %B202.if.i ]
  %.288.i1255 = add nsw i64 %.224.0305.i, -1
  %.292.i = add nuw nsw i64 %.221.0304.i, 1
  %46 = getelementptr i32, ptr %45, i64 %.221.0304.i
  %.372.i = load i32, ptr %46, align 4, !alias.scope !48, !noalias !57
  %.373.i = sext i32 %.372.i to i64
  %.389.i = mul i64 %arg.wx.6.0, %.373.i
  %.390.i = add i64 %.389.i, %.388.i
  %.391.i = inttoptr i64 %.390.i to ptr
  tail call void @llvm.prefetch.p0(ptr %.391.i, i32 0, i32 3, i32 1), !noalias !58
  %.405.i = mul i64 %arg.wy.6.0, %.373.i
  %.406.i = add i64 %.405.i, %.404.i
  %.407.i = inttoptr i64 %.406.i to ptr
  tail call void @llvm.prefetch.p0(ptr %.407.i, i32 0, i32 3, i32 1), !noalias !58
  %.421.i = mul i64 %arg.wz.6.0, %.373.i
  %.422.i = add i64 %.421.i, %.420.i
  %.423.i = inttoptr i64 %.422.i to ptr
  tail call void @llvm.prefetch.p0(ptr %.423.i, i32 0, i32 3, i32 1), !noalias !58
  %.439.i = mul i64 %arg.iw.6.0, %.373.i
  %.440.i = add i64 %.439.i, %.438.i
  %.441.i = inttoptr i64 %.440.i to ptr
  tail call void @llvm.prefetch.p0(ptr %.441.i, i32 0, i32 3, i32 1), !noalias !58
  %.455.i = mul i64 %arg.vary.6.0, %.373.i
  %.456.i = add i64 %.455.i, %.454.i
  %.457.i = inttoptr i64 %.456.i to ptr
  tail call void @llvm.prefetch.p0(ptr %.457.i, i32 0, i32 3, i32 1), !noalias !58
  %.279.i = icmp ugt i64 %.224.0305.i, 1
  br i1 %.279.i, label %B202.if.i, label %soon.2.exit

soon.2.exit:
  %.1036 = icmp slt i64 %.876.01324, 0
  %.1037 = select i1 %.1036, i64 %arg.lists.5.0, i64 0
  %47 = getelementptr i32, ptr %arg.lists.4, i64 %.876.01324
  %.1051 = getelementptr i32, ptr %47, i64 %.1037
  %.1052 = load i32, ptr %.1051, align 4
  %.1062 = sext i32 %.1052 to i64
  %.1084 = icmp slt i32 %.1052, 0
  %.1085 = select i1 %.1084, i64 %arg.made.5.0, i64 0
  %.1086 = add i64 %.1085, %.1062
  %.1106 = mul i64 %.1086, %arg.made.5.1
  %.1110 = getelementptr i32, ptr %arg.made.4, i64 %.1106
  %.1111 = load i32, ptr %.1110, align 4
  %.1166 = getelementptr i8, ptr %.1110, i64 4
  %.1167 = load i32, ptr %.1166, align 4
  %.1222 = getelementptr i8, ptr %.1110, i64 8
  %.1223 = load i32, ptr %.1222, align 4
  %.1226 = sext i32 %.1111 to i64
  %.1239 = icmp slt i32 %.1111, 0
  %.1240 = select i1 %.1239, i64 %arg.wx.5.0, i64 0
  %48 = getelementptr i32, ptr %arg.wx.4, i64 %.1240
  %.1254 = getelementptr i32, ptr %48, i64 %.1226
  %.1255 = load i32, ptr %.1254, align 4
  %.1271 = select i1 %.1239, i64 %arg.wy.5.0, i64 0
  %49 = getelementptr i32, ptr %arg.wy.4, i64 %.1271
  %.1285 = getelementptr i32, ptr %49, i64 %.1226
  %.1286 = load i32, ptr %.1285, align 4
  %.1288 = sext i32 %.1167 to i64
  %.1301 = icmp slt i32 %.1167, 0
  %.1302 = select i1 %.1301, i64 %arg.wx.5.0, i64 0
  %50 = getelementptr i32, ptr %arg.wx.4, i64 %.1302
  %.1316 = getelementptr i32, ptr %50, i64 %.1288
  %.1317 = load i32, ptr %.1316, align 4
  %.1333 = select i1 %.1301, i64 %arg.wy.5.0, i64 0
  %51 = getelementptr i32, ptr %arg.wy.4, i64 %.1333
  %.1347 = getelementptr i32, ptr %51, i64 %.1288
  %.1348 = load i32, ptr %.1347, align 4
  %.1350 = sext i32 %.1223 to i64
  %.1363 = icmp slt i32 %.1223, 0
  %.1364 = select i1 %.1363, i64 %arg.wx.5.0, i64 0
  %52 = getelementptr i32, ptr %arg.wx.4, i64 %.1364
  %.1378 = getelementptr i32, ptr %52, i64 %.1350
  %.1379 = load i32, ptr %.1378, align 4
  %.1395 = select i1 %.1363, i64 %arg.wy.5.0, i64 0
  %53 = getelementptr i32, ptr %arg.wy.4, i64 %.1395
  %.1409 = getelementptr i32, ptr %53, i64 %.1350
  %.1410 = load i32, ptr %.1409, align 4
  %.10.i = sext i32 %.1255 to i64
  %.11.i1256 = sext i32 %.1286 to i64
  %.12.i = sext i32 %.1317 to i64
  %.13.i = sub nsw i64 %.12.i, %.10.i
  %.14.i = sext i32 %.1348 to i64
  %.15.i = sub nsw i64 %.14.i, %.11.i1256
  %.16.i = sext i32 %.1379 to i64
  %.17.i = sub nsw i64 %.16.i, %.10.i
  %.18.i = sext i32 %.1410 to i64
  %.19.i = sub nsw i64 %.18.i, %.11.i1256
  %.1501 = getelementptr i8, ptr %.1110, i64 16
  %.1502 = load i32, ptr %.1501, align 4
  %.1503 = sext i32 %.1502 to i64
  %.11.i1257 = tail call i64 @llvm.smax.i64(i64 %rem.01288, i64 %.1503)
  %.1587 = getelementptr i8, ptr %.1110, i64 20
  %.1588 = load i32, ptr %.1587, align 4
  %.1589 = sext i32 %.1588 to i64
  %.11.i1258 = tail call i64 @llvm.smax.i64(i64 %quot.1.0, i64 %.1589)
  %.1679 = getelementptr i8, ptr %.1110, i64 24
  %.1680 = load i32, ptr %.1679, align 4
  %.1681 = sext i32 %.1680 to i64
  %.11.i1259 = tail call i64 @llvm.smin.i64(i64 %.1683, i64 %.1681)
  %.1766 = getelementptr i8, ptr %.1110, i64 28
  %.1767 = load i32, ptr %.1766, align 4
  %.1768 = sext i32 %.1767 to i64
  %.11.i1260 = tail call i64 @llvm.smin.i64(i64 %.1770, i64 %.1768)
  %.neg = mul nsw i64 %.15.i, -256
  %.1903.neg = sub nsw i64 %.15.i, %.19.i
  %.1905 = shl nsw i64 %.1903.neg, 8
  %.1906 = shl nsw i64 %.19.i, 8
  %reass.sub1329 = sub i64 %.11.i1260, %.11.i1258
  %.1922 = add i64 %reass.sub1329, 1
  %.20031309.not = icmp ugt i64 %reass.sub1329, 9223372036854775806
  br i1 %.20031309.not, label %B2190, label %B1382.if.lr.ph

B1382.if.lr.ph:
  %invariant.op = add nsw i64 %.11.i1259, 1
  %.1806 = shl nsw i64 %.11.i1257, 8
  %reass.sub = sub i64 %.1806, %.10.i
  %.1808 = add i64 %reass.sub, 128
  %.21.neg.neg.i = sub i64 %.1808, %.17.i
  %.23.neg.i1280 = mul i64 %.21.neg.neg.i, %.19.i
  %.26.i1273 = icmp slt i64 %.19.i, 1
  %.32.i1274 = icmp ne i32 %.1410, %.1286
  %.37.i1275 = icmp sgt i64 %.17.i, -1
  %or.cond.not.i1276 = select i1 %.32.i1274, i1 true, i1 %.37.i1275
  %narrow.i1277 = select i1 %.26.i1273, i1 %or.cond.not.i1276, i1 false
  %"$phi98.1.2.0.neg.i1278" = sext i1 %narrow.i1277 to i64
  %.24.i1281 = add i64 %.23.neg.i1280, %"$phi98.1.2.0.neg.i1278"
  %.1810 = shl nsw i64 %.11.i1258, 8
  %reass.sub1328 = sub i64 %.1810, %.11.i1256
  %.1812 = add i64 %reass.sub1328, 128
  %.18.neg.i = sub i64 %.19.i, %.1812
  %.20.i1279 = mul i64 %.18.neg.i, %.17.i
  %.56.i1282 = add i64 %.24.i1281, %.20.i1279
  %.21.neg.i = sub i64 %.13.i, %.1808
  %.11.i1262 = sub nsw i64 %.19.i, %.15.i
  %.23.neg.i = mul i64 %.21.neg.i, %.11.i1262
  %.26.i1263 = icmp sgt i64 %.11.i1262, -1
  %.32.i1264 = icmp ne i32 %.1410, %.1348
  %.10.i1261 = sub nsw i64 %.17.i, %.13.i
  %.37.i1265 = icmp slt i64 %.10.i1261, 1
  %or.cond.not.i1266 = select i1 %.32.i1264, i1 true, i1 %.37.i1265
  %narrow.i1267 = select i1 %.26.i1263, i1 %or.cond.not.i1266, i1 false
  %"$phi98.1.2.0.neg.i1268" = sext i1 %narrow.i1267 to i64
  %.24.i1271 = add i64 %.23.neg.i, %"$phi98.1.2.0.neg.i1268"
  %.18.i1269 = sub nsw i64 %.1812, %.15.i
  %.20.i1270 = mul nsw i64 %.18.i1269, %.10.i1261
  %.56.i1272 = add i64 %.24.i1271, %.20.i1270
  %.26.i = icmp sgt i64 %.15.i, -1
  %.32.i = icmp ne i32 %.1348, %.1286
  %.37.i = icmp slt i64 %.13.i, 1
  %or.cond.not.i = select i1 %.32.i, i1 true, i1 %.37.i
  %narrow.i = select i1 %.26.i, i1 %or.cond.not.i, i1 false
  %"$phi98.1.2.0.neg.i" = sext i1 %narrow.i to i64
  %.23.i = mul nsw i64 %.1808, %.15.i
  %.24.i = sub i64 %"$phi98.1.2.0.neg.i", %.23.i
  %.20.i = mul nsw i64 %.1812, %.13.i
  %.56.i = add i64 %.24.i, %.20.i
  %.2052 = sub nsw i64 %.11.i1259, %.11.i1257
  %.2053 = icmp slt i64 %.2052, 8
  %.20.i.i = icmp slt i64 %.15.i, 0
  %.144.i.i.not = icmp eq i32 %.1348, %.1286
  %.152.i.i = sub nsw i64 0, %.neg
  %.157.i.i = sitofp i64 %.152.i.i to double
  %.131.i.i = add nsw i64 %.11.i1257, -1
  %.35.i.i = uitofp i64 %.neg to double
  %.20.i15.i = icmp sgt i64 %.1903.neg, 0
  %.144.i19.i = icmp slt i64 %.1903.neg, 0
  %.152.i24.i = sub nsw i64 0, %.1905
  %.157.i26.i = sitofp i64 %.152.i24.i to double
  %.35.i38.i = uitofp i64 %.1905 to double
  %.20.i45.i = icmp sgt i64 %.19.i, 0
  %.144.i49.i = icmp slt i64 %.19.i, 0
  %.152.i54.i = sub nsw i64 0, %.1906
  %.157.i56.i = sitofp i64 %.152.i54.i to double
  %.35.i68.i = uitofp i64 %.1906 to double
  %.2118.reass = sub i64 %invariant.op, %.11.i1257
  %spec.select1291 = tail call i64 @llvm.smax.i64(i64 %.2118.reass, i64 0)
  %.21611300.not = icmp slt i64 %.2118.reass, 1
  %.2454 = shl nsw i64 %.13.i, 8
  %.2460 = shl nsw i64 %.10.i1261, 8
  %.2464 = shl nsw i64 %.17.i, 8
  br label %B1382.if

B1382.if:
  %seen.2.21318 = phi i1 [ false, %B1382.if.lr.ph ], [ %.2383, %B1722 ]
  %e0.2.21316 = phi i64 [ %.56.i, %B1382.if.lr.ph ], [ %.2456, %B1722 ]
  %e1.2.21314 = phi i64 [ %.56.i1272, %B1382.if.lr.ph ], [ %.2462, %B1722 ]
  %e2.2.21312 = phi i64 [ %.56.i1282, %B1382.if.lr.ph ], [ %.2466, %B1722 ]
  %.1949.01311 = phi i64 [ %.1922, %B1382.if.lr.ph ], [ %.2012, %B1722 ]
  %.1946.01310 = phi i64 [ 0, %B1382.if.lr.ph ], [ %.2016, %B1722 ]
  %.2012 = add nsw i64 %.1949.01311, -1
  %.2016 = add nuw nsw i64 %.1946.01310, 1
  br i1 %.2053, label %B1504, label %B1652

B1554.if:
  %i0.2.31307 = phi i64 [ %.2273, %B1554.if ], [ %e0.2.21316, %B1504 ]
  %i1.2.31306 = phi i64 [ %.2276, %B1554.if ], [ %e1.2.21314, %B1504 ]
  %i2.2.31305 = phi i64 [ %.2279, %B1554.if ], [ %e2.2.21312, %B1504 ]
  %first.3.31304 = phi i64 [ %first.4.4, %B1554.if ], [ 1073741824, %B1504 ]
  %last.4.31303 = phi i64 [ %last.5.4, %B1554.if ], [ -1, %B1504 ]
  %.2108.01302 = phi i64 [ %.2170, %B1554.if ], [ %spec.select1291, %B1504 ]
  %.2105.01301 = phi i64 [ %.2174, %B1554.if ], [ %.11.i1257, %B1504 ]
  %.2170 = add nsw i64 %.2108.01302, -1
  %.2174 = add i64 %.2105.01301, 1
  %.2214 = or i64 %i1.2.31306, %i2.2.31305
  %.2216 = or i64 %.2214, %i0.2.31307
  %.2217 = icmp sgt i64 %.2216, -1
  %.11.i = tail call i64 @llvm.smin.i64(i64 %.2105.01301, i64 %first.3.31304)
  %last.5.4 = select i1 %.2217, i64 %.2105.01301, i64 %last.4.31303
  %first.4.4 = select i1 %.2217, i64 %.11.i, i64 %first.3.31304
  %.2273 = add nsw i64 %i0.2.31307, %.neg
  %.2276 = add nsw i64 %i1.2.31306, %.1905
  %.2279 = add nsw i64 %i2.2.31305, %.1906
  %.2161 = icmp sgt i64 %.2108.01302, 1
  br i1 %.2161, label %B1554.if, label %B1650.loopexit

B1968.if:
  %.2536.01321 = phi i64 [ %.2598, %B1968.if ], [ 3, %B1908 ]
  %.2533.01320 = phi i64 [ %.2602, %B1968.if ], [ %.1922, %B1908 ]
  %.2598 = add nsw i64 %.2536.01321, -1
  %.2602 = add i64 %.2533.01320, 1
  %.2652 = getelementptr i32, ptr %arg.spans.4, i64 %.2533.01320
  store i32 1073741824, ptr %.2652, align 4
  %.2681 = getelementptr i8, ptr %.2652, i64 268
  store i32 -1, ptr %.2681, align 4
  %.2589 = icmp ugt i64 %.2536.01321, 1
  br i1 %.2589, label %B1968.if, label %B2094
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
!2 = distinct !{!2, !3, !"numbered.2: %arg.made.4"}
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
!49 = distinct !{!49, !47, !"soon.2: %arg.made.4"}
!50 = !{!51, !49, !52, !53, !54, !55, !56}
!51 = distinct !{!51, !47, !"soon.2: %retptr"}
!52 = distinct !{!52, !47, !"soon.2: %arg.window_x.4"}
!53 = distinct !{!53, !47, !"soon.2: %arg.window_y.4"}
!54 = distinct !{!54, !47, !"soon.2: %arg.depth.4"}
!55 = distinct !{!55, !47, !"soon.2: %arg.inverse_w.4"}
!56 = distinct !{!56, !47, !"soon.2: %arg.varyings.4"}
!57 = !{!51, !46, !52, !53, !54, !55, !56}
!58 = !{!51, !46}
