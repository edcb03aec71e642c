; Sources 8baf7d6345862153f6f93ce8dce036366c97b6cce981ca2dd97c93b19ca1195a
; Made by `python -m passgraph.backends.numpy.raster.generate`.

define internal i32 @tiles(ptr noalias %retptr, ptr noalias %excinfo, ptr noalias %arg.counter.0, ptr noalias %arg.counter.1, i64 %arg.counter.2, i64 %arg.counter.3, ptr noalias %arg.counter.4, i64 %arg.counter.5.0, i64 %arg.counter.6.0, i64 %arg.count, ptr noalias %arg.busy.0, ptr noalias %arg.busy.1, i64 %arg.busy.2, i64 %arg.busy.3, ptr noalias %arg.busy.4, i64 %arg.busy.5.0, i64 %arg.busy.6.0, i64 %arg.tiles_x, ptr noalias %arg.offsets.0, ptr noalias %arg.offsets.1, i64 %arg.offsets.2, i64 %arg.offsets.3, ptr noalias %arg.offsets.4, i64 %arg.offsets.5.0, i64 %arg.offsets.6.0, ptr noalias %arg.lists.0, ptr noalias %arg.lists.1, i64 %arg.lists.2, i64 %arg.lists.3, ptr noalias %arg.lists.4, i64 %arg.lists.5.0, i64 %arg.lists.6.0, ptr noalias %arg.made.0, ptr noalias %arg.made.1, i64 %arg.made.2, i64 %arg.made.3, ptr noalias %arg.made.4, i64 %arg.made.5.0, i64 %arg.made.5.1, i64 %arg.made.6.0, i64 %arg.made.6.1, ptr noalias %arg.wx.0, ptr noalias %arg.wx.1, i64 %arg.wx.2, i64 %arg.wx.3, ptr noalias %arg.wx.4, i64 %arg.wx.5.0, i64 %arg.wx.6.0, ptr noalias %arg.wy.0, ptr noalias %arg.wy.1, i64 %arg.wy.2, i64 %arg.wy.3, ptr noalias %arg.wy.4, i64 %arg.wy.5.0, i64 %arg.wy.6.0, ptr noalias %arg.wz.0, ptr noalias %arg.wz.1, i64 %arg.wz.2, i64 %arg.wz.3, ptr noalias %arg.wz.4, i64 %arg.wz.5.0, i64 %arg.wz.6.0, ptr noalias %arg.iw.0, ptr noalias %arg.iw.1, i64 %arg.iw.2, i64 %arg.iw.3, ptr noalias %arg.iw.4, i64 %arg.iw.5.0, i64 %arg.iw.6.0, ptr noalias %arg.vary.0, ptr noalias %arg.vary.1, i64 %arg.vary.2, i64 %arg.vary.3, ptr noalias %arg.vary.4, i64 %arg.vary.5.0, i64 %arg.vary.5.1, i64 %arg.vary.6.0, i64 %arg.vary.6.1, double %arg.factor, double %arg.units, i64 %arg.width, i64 %arg.height, ptr noalias %arg.depth.0, ptr noalias %arg.depth.1, i64 %arg.depth.2, i64 %arg.depth.3, ptr noalias %arg.depth.4, i64 %arg.depth.5.0, i64 %arg.depth.6.0, i64 %arg.has_depth, i64 %arg.test, i64 %arg.write, double %arg.clear, ptr noalias %arg.ids.0, ptr noalias %arg.ids.1, i64 %arg.ids.2, i64 %arg.ids.3, ptr noalias %arg.ids.4, i64 %arg.ids.5.0, i64 %arg.ids.6.0, ptr noalias %arg.slots.0, ptr noalias %arg.slots.1, i64 %arg.slots.2, i64 %arg.slots.3, ptr noalias %arg.slots.4, i64 %arg.slots.5.0, i64 %arg.slots.6.0, i64 %arg.rows, ptr noalias %arg.table.0, ptr noalias %arg.table.1, i64 %arg.table.2, i64 %arg.table.3, ptr noalias %arg.table.4, i64 %arg.table.5.0, i64 %arg.table.6.0, i64 %arg.shade, ptr noalias %arg.context.0, ptr noalias %arg.context.1, i64 %arg.context.2, i64 %arg.context.3, ptr noalias %arg.context.4, i64 %arg.context.5.0, i64 %arg.context.6.0) {
entry:
  %.209 = and i64 %arg.test, 1
  %.210 = icmp ne i64 %.209, 0
  %.211 = and i64 %arg.test, 2
  %.212 = icmp ne i64 %.211, 0
  %.213 = and i64 %arg.test, 4
  %.214 = icmp ne i64 %.213, 0
  %.224 = icmp ne i64 %arg.write, 0
  %.2361485 = atomicrmw add ptr %arg.counter.4, i64 1 monotonic, align 8
  %.242.not1486 = icmp slt i64 %.2361485, %arg.count
  br i1 %.242.not1486, label %B148.lr.ph, label %B144

B148.lr.ph:
  %.346 = icmp ne i64 %arg.tiles_x, 0
  %.358 = icmp ne i64 %arg.tiles_x, -1
  %0 = trunc i64 %arg.tiles_x to i32
  %.505.not = icmp eq i64 %arg.has_depth, 0
  %"$phi406.0.2.sroa.0.1" = select i1 %.505.not, i64 64, i64 %arg.width
  %.540 = fcmp ord double %arg.clear, 0.000000e+00
  %.784 = fptrunc double %arg.clear to float
  %.1018 = icmp slt i64 %arg.ids.5.0, 1
  %.154.i = ptrtoint ptr %arg.made.4 to i64
  %.388.i = ptrtoint ptr %arg.wx.4 to i64
  %.404.i = ptrtoint ptr %arg.wy.4 to i64
  %.420.i = ptrtoint ptr %arg.wz.4 to i64
  %.67.i = fcmp une double %arg.factor, 0.000000e+00
  %.74.i = fcmp une double %arg.units, 0.000000e+00
  %or.cond.i = select i1 %.67.i, i1 true, i1 %.74.i
  %.3436.not = icmp eq i64 %arg.shade, 0
  %.508.i.i = mul nsw i64 %arg.rows, 3
  %.509.i.i = add nsw i64 %.508.i.i, 2
  %.794.i.i = icmp sgt i64 %arg.rows, 1
  %.1150624.not.i.i = icmp slt i64 %arg.vary.5.1, 1
  %.3535 = inttoptr i64 %arg.shade to ptr
  %1 = shl i64 %arg.ids.5.0, 2
  br label %B148

B144:
  store ptr null, ptr %retptr, align 8
  ret i32 0

B148:
  %.2361487 = phi i64 [ %.2361485, %B148.lr.ph ], [ %.236, %B3008 ]
  %.320 = icmp slt i64 %.2361487, 0
  %.321 = select i1 %.320, i64 %arg.busy.5.0, i64 0
  %2 = getelementptr i64, ptr %arg.busy.4, i64 %.2361487
  %.335 = getelementptr i64, ptr %2, i64 %.321
  %.336 = load i64, ptr %.335, align 8
  %.357 = icmp ne i64 %.336, -9223372036854775808
  %.359.not = or i1 %.358, %.357
  %or.cond1497 = select i1 %.346, i1 %.359.not, i1 false, !prof !0
  br i1 %or.cond1497, label %B148.else.if, label %B148.endif.endif, !prof !0

B426:
  %.580 = sub i64 %.11.i1408, %quot.1.0
  %.6231459.not = icmp slt i64 %.580, 1
  br i1 %.6231459.not, label %B602.else.endif, label %B458.if.lr.ph

B458.if.lr.ph:
  %.702 = sub i64 %.11.i1407, %rem.01448
  %spec.select1452 = tail call i64 @llvm.smax.i64(i64 %.702, i64 0)
  %.7451456.not = icmp slt i64 %.702, 1
  br label %B458.if

B458.loopexit:
  %.623 = icmp ugt i64 %.570.01460, 1
  br i1 %.623, label %B458.if, label %B602.else.endif

B686.loopexit:
  %.1284 = icmp sgt i64 %.1230.01483, 1
  br i1 %.1284, label %B688.if, label %B2890

B1826:
  br i1 %.26601467.not, label %B2828, label %B1876.if.lr.ph

B1876.if.lr.ph:
  %3 = getelementptr float, ptr %arg.depth.4, i64 %.2546
  %4 = getelementptr i32, ptr %arg.ids.4, i64 %.2551
  br label %B1876.if

B1904:
  %.2709 = sitofp i64 %.2604.01468 to double
  %.2711 = fmul double %.19.i.i, %.2709
  %.2713 = fadd double %.2542, %.2711
  %.10.i = fcmp olt double %.2713, 0.000000e+00
  %.11.i = select i1 %.10.i, double 0.000000e+00, double %.2713
  %.10.i1404 = fcmp ogt double %.11.i, 1.000000e+00
  %.11.i1405 = select i1 %.10.i1404, double 1.000000e+00, double %.11.i
  %.2770 = fptrunc double %.11.i1405 to float
  %.2802 = getelementptr float, ptr %3, i64 %.2604.01468
  %.2803 = load float, ptr %.2802, align 4
  %.2811 = fcmp ogt float %.2803, %.2770
  %or.cond = select i1 %.210, i1 %.2811, i1 false
  %.2817 = fcmp oeq float %.2803, %.2770
  %or.cond1398 = select i1 %.212, i1 %.2817, i1 false
  %or.cond1401 = select i1 %or.cond, i1 true, i1 %or.cond1398
  %.2823 = fcmp olt float %.2803, %.2770
  %or.cond1399 = select i1 %.214, i1 %.2823, i1 false
  %or.cond1402 = select i1 %or.cond1401, i1 true, i1 %or.cond1399
  br i1 %or.cond1402, label %B2144, label %B2258

B2144:
  %.2860 = getelementptr i32, ptr %4, i64 %.2604.01468
  store i32 %extract.t, ptr %.2860, align 4
  br i1 %.224, label %B2206, label %B2258

B2206:
  store float %.2770, ptr %.2802, align 4
  br label %B2258

B2258:
  %.2909 = add nsw i64 %i0.2.31472, %.neg
  %.2912 = add nsw i64 %i1.2.31471, %.2406
  %.2915 = add nsw i64 %i2.2.31470, %.2407
  %.2660 = icmp sgt i64 %.2607.01469, 1
  br i1 %.2660, label %B1876.if, label %B2828

B2294:
  %.27.i.i = icmp slt i64 %e0.2.21480, 0
  br i1 %.20.i.i, label %B16.i.i, label %B148.i.i

B16.i.i:
  br i1 %.27.i.i, label %B28.i.i, label %narrowed.2.exit.i

B28.i.i:
  %.30.i.i = sub i64 0, %e0.2.21480
  %.34.i.i = sitofp i64 %.30.i.i to double
  %.39.i.i = fdiv double %.34.i.i, %.35.i.i
  %.49.le.i.i = tail call double @llvm.ceil.f64(double %.39.i.i)
  %.54.i.i = fptosi double %.49.le.i.i to i64
  %.56.i.i = add nsw i64 %.11.i1412, %.54.i.i
  %.11.i.i.i = tail call i64 @llvm.smax.i64(i64 %.56.i.i, i64 %.11.i1412)
  br label %narrowed.2.exit.i

B148.i.i:
  %brmerge = select i1 %.27.i.i, i1 true, i1 %.144.i.i.not
  %.131.i.i.mux = select i1 %.27.i.i, i64 %.131.i.i, i64 %.11.i1414
  br i1 %brmerge, label %narrowed.2.exit.i, label %B184.i.i

B184.i.i:
  %.156.i.i = uitofp i64 %e0.2.21480 to double
  %.161.i.i = fdiv double %.156.i.i, %.157.i.i
  %.171.le.i.i = tail call double @llvm.floor.f64(double %.161.i.i)
  %.176.i.i = fptosi double %.171.le.i.i to i64
  %.178.i.i = add nsw i64 %.11.i1412, %.176.i.i
  %.11.i55.i.i = tail call i64 @llvm.smin.i64(i64 %.178.i.i, i64 %.11.i1414)
  br label %narrowed.2.exit.i

narrowed.2.exit.i:
  %first.2.0.i.i = phi i64 [ %.11.i1412, %B148.i.i ], [ %.11.i1412, %B16.i.i ], [ %.11.i1412, %B184.i.i ], [ %.11.i.i.i, %B28.i.i ]
  %last.3.0.i.i = phi i64 [ %.131.i.i.mux, %B148.i.i ], [ %.11.i1414, %B16.i.i ], [ %.11.i55.i.i, %B184.i.i ], [ %.11.i1414, %B28.i.i ]
  %.27.i16.i = icmp slt i64 %e1.2.21478, 0
  br i1 %.20.i15.i, label %B16.i34.i, label %B148.i17.i

B16.i34.i:
  br i1 %.27.i16.i, label %B28.i35.i, label %narrowed.2.exit44.i

B28.i35.i:
  %.30.i36.i = sub i64 0, %e1.2.21478
  %.34.i37.i = sitofp i64 %.30.i36.i to double
  %.39.i39.i = fdiv double %.34.i37.i, %.35.i38.i
  %.49.le.i40.i = tail call double @llvm.ceil.f64(double %.39.i39.i)
  %.54.i41.i = fptosi double %.49.le.i40.i to i64
  %.56.i42.i = add nsw i64 %.11.i1412, %.54.i41.i
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
  %.156.i25.i = uitofp i64 %e1.2.21478 to double
  %.161.i27.i = fdiv double %.156.i25.i, %.157.i26.i
  %.171.le.i28.i = tail call double @llvm.floor.f64(double %.161.i27.i)
  %.176.i29.i = fptosi double %.171.le.i28.i to i64
  %.178.i30.i = add nsw i64 %.11.i1412, %.176.i29.i
  %.11.i55.i31.i = tail call i64 @llvm.smin.i64(i64 %.178.i30.i, i64 %last.3.0.i.i)
  br label %narrowed.2.exit44.i

narrowed.2.exit44.i:
  %first.2.0.i20.i = phi i64 [ %first.2.0.i.i, %B172.i18.i ], [ %first.2.0.i.i, %B160.i32.i ], [ %first.2.0.i.i, %B184.i23.i ], [ %.11.i.i43.i, %B28.i35.i ], [ %first.2.0.i.i, %B16.i34.i ]
  %last.3.0.i21.i = phi i64 [ %last.3.0.i.i, %B172.i18.i ], [ %.131.i33.i, %B160.i32.i ], [ %.11.i55.i31.i, %B184.i23.i ], [ %last.3.0.i.i, %B28.i35.i ], [ %last.3.0.i.i, %B16.i34.i ]
  %.27.i46.i = icmp slt i64 %e2.2.21476, 0
  br i1 %.20.i45.i, label %B16.i64.i, label %B148.i47.i

B16.i64.i:
  br i1 %.27.i46.i, label %B28.i65.i, label %span.2.exit

B28.i65.i:
  %.30.i66.i = sub i64 0, %e2.2.21476
  %.34.i67.i = sitofp i64 %.30.i66.i to double
  %.39.i69.i = fdiv double %.34.i67.i, %.35.i68.i
  %.49.le.i70.i = tail call double @llvm.ceil.f64(double %.39.i69.i)
  %.54.i71.i = fptosi double %.49.le.i70.i to i64
  %.56.i72.i = add nsw i64 %.11.i1412, %.54.i71.i
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
  %.156.i55.i = uitofp i64 %e2.2.21476 to double
  %.161.i57.i = fdiv double %.156.i55.i, %.157.i56.i
  %.171.le.i58.i = tail call double @llvm.floor.f64(double %.161.i57.i)
  %.176.i59.i = fptosi double %.171.le.i58.i to i64
  %.178.i60.i = add nsw i64 %.11.i1412, %.176.i59.i
  %.11.i55.i61.i = tail call i64 @llvm.smin.i64(i64 %.178.i60.i, i64 %last.3.0.i21.i)
  br label %span.2.exit

span.2.exit:
  %first.2.0.i50.i = phi i64 [ %first.2.0.i20.i, %B172.i48.i ], [ %first.2.0.i20.i, %B160.i62.i ], [ %first.2.0.i20.i, %B184.i53.i ], [ %.11.i.i73.i, %B28.i65.i ], [ %first.2.0.i20.i, %B16.i64.i ]
  %last.3.0.i51.i = phi i64 [ %last.3.0.i21.i, %B172.i48.i ], [ %.131.i63.i, %B160.i62.i ], [ %.11.i55.i61.i, %B184.i53.i ], [ %last.3.0.i21.i, %B28.i65.i ], [ %last.3.0.i21.i, %B16.i64.i ]
  %reass.sub1490 = sub i64 %last.3.0.i51.i, %first.2.0.i50.i
  %.30551464.not = icmp ugt i64 %reass.sub1490, 9223372036854775806
  br i1 %.30551464.not, label %B2828, label %B2382.if.lr.ph

B2382.if.lr.ph:
  %.3012 = add nuw nsw i64 %reass.sub1490, 1
  %5 = getelementptr float, ptr %arg.depth.4, i64 %.2546
  %6 = getelementptr i32, ptr %arg.ids.4, i64 %.2551
  br label %B2382.if

B2708:
  %.3221 = load i32, ptr %.3220, align 4
  br label %B2710

B2710:
  %"$phi2710.3.2.5.off0" = phi i32 [ %.3221, %B2708 ], [ %extract.t, %B2382.if ]
  store i32 %"$phi2710.3.2.5.off0", ptr %.3220, align 4
  %.3302 = and i1 %.224, %.3244
  %.3158..3191 = select i1 %.3302, float %.3158, float %.3191
  store float %.3158..3191, ptr %.3190, align 4
  %.3055 = icmp ugt i64 %.3002.01466, 1
  br i1 %.3055, label %B2382.if, label %B2828

B2828:
  %.3372 = add nsw i64 %e0.2.21480, %.3370
  %.3378 = add nsw i64 %e1.2.21478, %.3376
  %.3382 = sub nsw i64 %e2.2.21476, %.3380
  %.2498 = icmp sgt i64 %.2444.01475, 1
  br i1 %.2498, label %B1724.if, label %B686.loopexit

B2890:
  br i1 %.3436.not, label %B3008, label %B2902

B2890.thread:
  br i1 %.3436.not, label %B3008, label %B56.i

B2902:
  tail call void @llvm.experimental.noalias.scope.decl(metadata !1)
  tail call void @llvm.experimental.noalias.scope.decl(metadata !4)
  tail call void @llvm.experimental.noalias.scope.decl(metadata !6)
  tail call void @llvm.experimental.noalias.scope.decl(metadata !8)
  tail call void @llvm.experimental.noalias.scope.decl(metadata !10)
  tail call void @llvm.experimental.noalias.scope.decl(metadata !12)
  tail call void @llvm.experimental.noalias.scope.decl(metadata !14)
  tail call void @llvm.experimental.noalias.scope.decl(metadata !16)
  tail call void @llvm.experimental.noalias.scope.decl(metadata !18)
  tail call void @llvm.experimental.noalias.scope.decl(metadata !20)
  %7 = sub i64 %.1195, %.1161
  %8 = shl i64 %7, 2
  tail call void @llvm.memset.p0.i64(ptr align 4 %arg.slots.4, i8 -1, i64 %8, i1 false), !alias.scope !4, !noalias !22
  br label %B56.i

B56.i:
  br i1 %.1018, label %visible.2.exit, label %B116.if.i

B150.i:
  %.508.i = getelementptr i32, ptr %arg.slots.4, i64 %.460.i
  %.509.i = load i32, ptr %.508.i, align 4, !alias.scope !4, !noalias !22
  %.515.i = icmp slt i32 %.509.i, 0
  br i1 %.515.i, label %B178.i, label %B276.i

B178.i:
  %.551.i = trunc i64 %number.2.0307.i to i32
  store i32 %.551.i, ptr %.508.i, align 4, !alias.scope !4, !noalias !22
  %.554.i = add nsw i64 %number.2.0307.i, 1
  %.562.i = add nsw i64 %.1161, %.460.i
  %.578.i = icmp slt i64 %.562.i, 0
  %.579.i = select i1 %.578.i, i64 %arg.lists.5.0, i64 0
  %9 = getelementptr i32, ptr %arg.lists.4, i64 %.562.i
  %.593.i = getelementptr i32, ptr %9, i64 %.579.i
  %.594.i = load i32, ptr %.593.i, align 4, !alias.scope !6, !noalias !24
  tail call void @llvm.experimental.noalias.scope.decl(metadata !25)
  tail call void @llvm.experimental.noalias.scope.decl(metadata !28)
  tail call void @llvm.experimental.noalias.scope.decl(metadata !30)
  tail call void @llvm.experimental.noalias.scope.decl(metadata !32)
  tail call void @llvm.experimental.noalias.scope.decl(metadata !34)
  tail call void @llvm.experimental.noalias.scope.decl(metadata !36)
  tail call void @llvm.experimental.noalias.scope.decl(metadata !38)
  %.90.i.i = sext i32 %.594.i to i64
  %.112.i.i = icmp slt i32 %.594.i, 0
  %.113.i.i = select i1 %.112.i.i, i64 %arg.made.5.0, i64 0
  %.114.i.i = add i64 %.113.i.i, %.90.i.i
  %.134.i.i = mul i64 %.114.i.i, %arg.made.5.1
  %.138.i.i = getelementptr i32, ptr %arg.made.4, i64 %.134.i.i
  %.139.i.i = load i32, ptr %.138.i.i, align 4, !alias.scope !40, !noalias !41
  %.192.i.i = getelementptr i8, ptr %.138.i.i, i64 4
  %.193.i.i = load i32, ptr %.192.i.i, align 4, !alias.scope !40, !noalias !41
  %.246.i.i = getelementptr i8, ptr %.138.i.i, i64 8
  %.247.i.i = load i32, ptr %.246.i.i, align 4, !alias.scope !40, !noalias !41
  %.259.i.i = sext i32 %.139.i.i to i64
  %.272.i.i = icmp slt i32 %.139.i.i, 0
  %.273.i.i = select i1 %.272.i.i, i64 %arg.wx.5.0, i64 0
  %10 = getelementptr i32, ptr %arg.wx.4, i64 %.273.i.i
  %.287.i.i = getelementptr i32, ptr %10, i64 %.259.i.i
  %.288.i.i = load i32, ptr %.287.i.i, align 4, !alias.scope !43, !noalias !44
  %.304.i.i = select i1 %.272.i.i, i64 %arg.wy.5.0, i64 0
  %11 = getelementptr i32, ptr %arg.wy.4, i64 %.304.i.i
  %.318.i.i = getelementptr i32, ptr %11, i64 %.259.i.i
  %.319.i.i = load i32, ptr %.318.i.i, align 4, !alias.scope !45, !noalias !46
  %.321.i.i = sext i32 %.193.i.i to i64
  %.334.i.i = icmp slt i32 %.193.i.i, 0
  %.335.i.i = select i1 %.334.i.i, i64 %arg.wx.5.0, i64 0
  %12 = getelementptr i32, ptr %arg.wx.4, i64 %.335.i.i
  %.349.i.i = getelementptr i32, ptr %12, i64 %.321.i.i
  %.350.i.i = load i32, ptr %.349.i.i, align 4, !alias.scope !43, !noalias !44
  %.366.i.i = select i1 %.334.i.i, i64 %arg.wy.5.0, i64 0
  %13 = getelementptr i32, ptr %arg.wy.4, i64 %.366.i.i
  %.380.i.i = getelementptr i32, ptr %13, i64 %.321.i.i
  %.381.i.i = load i32, ptr %.380.i.i, align 4, !alias.scope !45, !noalias !46
  %.383.i.i = sext i32 %.247.i.i to i64
  %.396.i.i = icmp slt i32 %.247.i.i, 0
  %.397.i.i = select i1 %.396.i.i, i64 %arg.wx.5.0, i64 0
  %14 = getelementptr i32, ptr %arg.wx.4, i64 %.397.i.i
  %.411.i.i = getelementptr i32, ptr %14, i64 %.383.i.i
  %.412.i.i = load i32, ptr %.411.i.i, align 4, !alias.scope !43, !noalias !44
  %.428.i.i = select i1 %.396.i.i, i64 %arg.wy.5.0, i64 0
  %15 = getelementptr i32, ptr %arg.wy.4, i64 %.428.i.i
  %.442.i.i = getelementptr i32, ptr %15, i64 %.383.i.i
  %.443.i.i = load i32, ptr %.442.i.i, align 4, !alias.scope !45, !noalias !46
  %.10.i.i.i = sext i32 %.288.i.i to i64
  %.11.i.i.i1406 = sext i32 %.319.i.i to i64
  %.12.i.i.i = sext i32 %.350.i.i to i64
  %.13.i.i.i = sub nsw i64 %.12.i.i.i, %.10.i.i.i
  %.14.i.i.i = sext i32 %.381.i.i to i64
  %.15.i.i.i = sub nsw i64 %.14.i.i.i, %.11.i.i.i1406
  %.16.i.i.i = sext i32 %.412.i.i to i64
  %.17.i.i.i = sub nsw i64 %.16.i.i.i, %.10.i.i.i
  %.18.i.i.i = sext i32 %.443.i.i to i64
  %.19.i.i.i = sub nsw i64 %.18.i.i.i, %.11.i.i.i1406
  %.490.i.i = mul nsw i64 %.19.i.i.i, %.13.i.i.i
  %.493.i.i = mul nsw i64 %.17.i.i.i, %.15.i.i.i
  %.494.i.i = sub nsw i64 %.490.i.i, %.493.i.i
  %.495.i.i = sitofp i64 %.494.i.i to double
  %.499.i.i = sitofp i32 %.288.i.i to double
  %.503.i.i = fmul double %.499.i.i, 3.906250e-03
  %.504.i.i = fsub double 5.000000e-01, %.503.i.i
  %.510.i.i = mul nsw i64 %number.2.0307.i, %.509.i.i
  %.511.i.i = sitofp i32 %.319.i.i to double
  %.515.i.i = fmul double %.511.i.i, 3.906250e-03
  %.516.i.i = fsub double 5.000000e-01, %.515.i.i
  %.543.i.i = getelementptr double, ptr %arg.table.4, i64 %.510.i.i
  store double %.516.i.i, ptr %.543.i.i, align 8, !alias.scope !47, !noalias !48
  %.597.i.i = getelementptr i8, ptr %.138.i.i, i64 12
  %.598.i.i = load i32, ptr %.597.i.i, align 4, !alias.scope !40, !noalias !41
  %.625.i.i = getelementptr i8, ptr %.543.i.i, i64 8
  %.626.i.i = sitofp i32 %.598.i.i to double
  store double %.626.i.i, ptr %.625.i.i, align 8, !alias.scope !47, !noalias !48
  %.648.i.i = select i1 %.272.i.i, i64 %arg.wz.5.0, i64 0
  %16 = getelementptr double, ptr %arg.wz.4, i64 %.648.i.i
  %.662.i.i = getelementptr double, ptr %16, i64 %.259.i.i
  %.663.i.i = load double, ptr %.662.i.i, align 8, !alias.scope !49, !noalias !50
  %.679.i.i = select i1 %.334.i.i, i64 %arg.wz.5.0, i64 0
  %17 = getelementptr double, ptr %arg.wz.4, i64 %.679.i.i
  %.693.i.i = getelementptr double, ptr %17, i64 %.321.i.i
  %.694.i.i = load double, ptr %.693.i.i, align 8, !alias.scope !49, !noalias !50
  %.710.i.i = select i1 %.396.i.i, i64 %arg.wz.5.0, i64 0
  %18 = getelementptr double, ptr %arg.wz.4, i64 %.710.i.i
  %.724.i.i = getelementptr double, ptr %18, i64 %.383.i.i
  %.725.i.i = load double, ptr %.724.i.i, align 8, !alias.scope !49, !noalias !50
  %.730.i.i = fdiv double 2.560000e+02, %.495.i.i
  %.12.i.i.i.i = fsub double %.694.i.i, %.663.i.i
  %.13.i.i.i.i = sitofp i64 %.19.i.i.i to double
  %.14.i.i.i.i = fmul double %.12.i.i.i.i, %.13.i.i.i.i
  %.15.i.i.i.i = fsub double %.725.i.i, %.663.i.i
  %.16.i.i.i.i = sitofp i64 %.15.i.i.i to double
  %.17.i.i.i.i = fmul double %.15.i.i.i.i, %.16.i.i.i.i
  %.18.i.i.i.i = fsub double %.14.i.i.i.i, %.17.i.i.i.i
  %.19.i.i.i.i = fmul double %.730.i.i, %.18.i.i.i.i
  %.21.i.i.i.i = sitofp i64 %.13.i.i.i to double
  %.22.i.i.i.i = fmul double %.15.i.i.i.i, %.21.i.i.i.i
  %.24.i.i.i.i = sitofp i64 %.17.i.i.i to double
  %.25.i.i.i.i = fmul double %.12.i.i.i.i, %.24.i.i.i.i
  %.26.i.i.i.i = fsub double %.22.i.i.i.i, %.25.i.i.i.i
  %.27.i.i.i.i = fmul double %.730.i.i, %.26.i.i.i.i
  br i1 %or.cond.i, label %B80.i.i.i, label %depth_plane.2.exit.i.i

B80.i.i.i:
  %.79.i.i.i = tail call double @llvm.fabs.f64(double %.663.i.i)
  %.83.i.i.i = tail call double @llvm.fabs.f64(double %.694.i.i)
  %.87.i.i.i = tail call double @llvm.fabs.f64(double %.725.i.i)
  %.13.i10.i.i.i = fcmp ogt double %.83.i.i.i, %.79.i.i.i
  %.14.i11.i.i.i = select i1 %.13.i10.i.i.i, double %.83.i.i.i, double %.79.i.i.i
  %.15.i12.i.i.i = fcmp ogt double %.87.i.i.i, %.14.i11.i.i.i
  %.16.i13.i.i.i = select i1 %.15.i12.i.i.i, double %.87.i.i.i, double %.14.i11.i.i.i
  %.124.i.i.i = fcmp ogt double %.16.i13.i.i.i, 0.000000e+00
  br i1 %.124.i.i.i, label %for.body.i.i.i, label %B294.i.i.i

B294.i.i.i:
  %"$phi294.0.2.0.i.i.i" = phi double [ %exp2.i.i.i, %for.body.i.i.i ], [ 0.000000e+00, %B80.i.i.i ]
  %.168.i.i.i = tail call double @llvm.fabs.f64(double %.19.i.i.i.i)
  %.170.i.i.i = tail call double @llvm.fabs.f64(double %.27.i.i.i.i)
  %.10.i.i.i.i = fcmp ogt double %.170.i.i.i, %.168.i.i.i
  %.11.i.i.i.i = select i1 %.10.i.i.i.i, double %.170.i.i.i, double %.168.i.i.i
  %.200.i.i.i = fmul double %arg.factor, %.11.i.i.i.i
  %.204.i.i.i = fmul double %arg.units, %"$phi294.0.2.0.i.i.i"
  %.207.i.i.i = fadd double %.200.i.i.i, %.204.i.i.i
  %.209.i.i.i = fadd double %.663.i.i, %.207.i.i.i
  br label %depth_plane.2.exit.i.i

for.body.i.i.i:
  %.134.le.i.i.i = tail call double @llvm.log2.f64(double %.16.i13.i.i.i)
  %.148.le.i.i.i = tail call double @llvm.floor.f64(double %.134.le.i.i.i)
  %.153.i.i.i = fadd double %.148.le.i.i.i, -2.300000e+01
  %exp2.i.i.i = tail call double @llvm.exp2.f64(double %.153.i.i.i)
  br label %B294.i.i.i

depth_plane.2.exit.i.i:
  %start.2.1.i.i.i = phi double [ %.209.i.i.i, %B294.i.i.i ], [ %.663.i.i, %B178.i ]
  %.764.i.i = fmul double %.504.i.i, %.19.i.i.i.i
  %.765.i.i = fadd double %.764.i.i, %start.2.1.i.i.i
  %.44.i.i.i = getelementptr i8, ptr %.543.i.i, i64 16
  store double %.765.i.i, ptr %.44.i.i.i, align 8, !alias.scope !51, !noalias !54
  %.71.i.i.i = getelementptr i8, ptr %.543.i.i, i64 24
  store double %.19.i.i.i.i, ptr %.71.i.i.i, align 8, !alias.scope !51, !noalias !54
  %.98.i.i.i = getelementptr i8, ptr %.543.i.i, i64 32
  store double %.27.i.i.i.i, ptr %.98.i.i.i, align 8, !alias.scope !51, !noalias !54
  br i1 %.794.i.i, label %B738.i.i, label %B276.i

B738.i.i:
  %.799.i.i = fmul double %.13.i.i.i.i, 2.560000e+02
  %.801.i.i = fmul double %.504.i.i, %.799.i.i
  %.802.i.i = fadd double %.801.i.i, 0.000000e+00
  %.810.i.i = fmul double %.24.i.i.i.i, -2.560000e+02
  %.44.i614.i.i = getelementptr i8, ptr %.543.i.i, i64 40
  store double %.802.i.i, ptr %.44.i614.i.i, align 8, !alias.scope !56, !noalias !59
  %.71.i615.i.i = getelementptr i8, ptr %.543.i.i, i64 48
  store double %.799.i.i, ptr %.71.i615.i.i, align 8, !alias.scope !56, !noalias !59
  %.98.i616.i.i = getelementptr i8, ptr %.543.i.i, i64 56
  store double %.810.i.i, ptr %.98.i616.i.i, align 8, !alias.scope !56, !noalias !59
  %.844.i.i = fmul double %.16.i.i.i.i, -2.560000e+02
  %.846.i.i = fmul double %.504.i.i, %.844.i.i
  %.849.i.i = fadd double %.846.i.i, 0.000000e+00
  %.857.i.i = fmul double %.21.i.i.i.i, 2.560000e+02
  %.44.i617.i.i = getelementptr i8, ptr %.543.i.i, i64 64
  store double %.849.i.i, ptr %.44.i617.i.i, align 8, !alias.scope !61, !noalias !64
  %.71.i618.i.i = getelementptr i8, ptr %.543.i.i, i64 72
  store double %.844.i.i, ptr %.71.i618.i.i, align 8, !alias.scope !61, !noalias !64
  %.98.i619.i.i = getelementptr i8, ptr %.543.i.i, i64 80
  store double %.857.i.i, ptr %.98.i619.i.i, align 8, !alias.scope !61, !noalias !64
  %.905.i.i = select i1 %.334.i.i, i64 %arg.iw.5.0, i64 0
  %19 = getelementptr double, ptr %arg.iw.4, i64 %.905.i.i
  %.919.i.i = getelementptr double, ptr %19, i64 %.321.i.i
  %.920.i.i = load double, ptr %.919.i.i, align 8, !alias.scope !66, !noalias !67
  %.937.i.i = select i1 %.272.i.i, i64 %arg.iw.5.0, i64 0
  %20 = getelementptr double, ptr %arg.iw.4, i64 %.937.i.i
  %.951.i.i = getelementptr double, ptr %20, i64 %.259.i.i
  %.952.i.i = load double, ptr %.951.i.i, align 8, !alias.scope !66, !noalias !67
  %.956.i.i = fdiv double %.920.i.i, %.952.i.i
  %.973.i.i = select i1 %.396.i.i, i64 %arg.iw.5.0, i64 0
  %21 = getelementptr double, ptr %arg.iw.4, i64 %.973.i.i
  %.987.i.i = getelementptr double, ptr %21, i64 %.383.i.i
  %.988.i.i = load double, ptr %.987.i.i, align 8, !alias.scope !66, !noalias !67
  %.1026.i.i = fdiv double %.988.i.i, %.952.i.i
  %.44.i620.i.i = getelementptr i8, ptr %.543.i.i, i64 88
  store double %.495.i.i, ptr %.44.i620.i.i, align 8, !alias.scope !68, !noalias !71
  %.71.i621.i.i = getelementptr i8, ptr %.543.i.i, i64 96
  store double %.956.i.i, ptr %.71.i621.i.i, align 8, !alias.scope !68, !noalias !71
  %.98.i622.i.i = getelementptr i8, ptr %.543.i.i, i64 104
  store double %.1026.i.i, ptr %.98.i622.i.i, align 8, !alias.scope !68, !noalias !71
  br i1 %.1150624.not.i.i, label %B276.i, label %B1060.if.lr.ph.i.i

B1060.if.lr.ph.i.i:
  %.1217.i.i = select i1 %.272.i.i, i64 %arg.vary.5.0, i64 0
  %.1218.i.i = add i64 %.1217.i.i, %.259.i.i
  %.1238.i.i = mul i64 %.1218.i.i, %arg.vary.5.1
  %22 = getelementptr float, ptr %arg.vary.4, i64 %.1238.i.i
  %.1275.i.i = select i1 %.334.i.i, i64 %arg.vary.5.0, i64 0
  %.1276.i.i = add i64 %.1275.i.i, %.321.i.i
  %.1296.i.i = mul i64 %.1276.i.i, %arg.vary.5.1
  %23 = getelementptr float, ptr %arg.vary.4, i64 %.1296.i.i
  %.1332.i.i = select i1 %.396.i.i, i64 %arg.vary.5.0, i64 0
  %.1333.i.i = add i64 %.1332.i.i, %.383.i.i
  %.1353.i.i = mul i64 %.1333.i.i, %arg.vary.5.1
  %24 = getelementptr float, ptr %arg.vary.4, i64 %.1353.i.i
  br label %B1060.if.i.i

B1060.if.i.i:
  %.1097.0626.i.i = phi i64 [ %arg.vary.5.1, %B1060.if.lr.ph.i.i ], [ %.1159.i.i, %B1060.if.i.i ]
  %.1094.0625.i.i = phi i64 [ 0, %B1060.if.lr.ph.i.i ], [ %.1163.i.i, %B1060.if.i.i ]
  %.1159.i.i = add nsw i64 %.1097.0626.i.i, -1
  %.1163.i.i = add nuw nsw i64 %.1094.0625.i.i, 1
  %.1242.i.i = getelementptr float, ptr %22, i64 %.1094.0625.i.i
  %.1243.i.i = load float, ptr %.1242.i.i, align 4, !alias.scope !73, !noalias !74
  %.1300.i.i = getelementptr float, ptr %23, i64 %.1094.0625.i.i
  %.1301.i.i = load float, ptr %.1300.i.i, align 4, !alias.scope !73, !noalias !74
  %.1302.i.i = fsub float %.1301.i.i, %.1243.i.i
  %.1357.i.i = getelementptr float, ptr %24, i64 %.1094.0625.i.i
  %.1358.i.i = load float, ptr %.1357.i.i, align 4, !alias.scope !73, !noalias !74
  %.1359.i.i = fsub float %.1358.i.i, %.1243.i.i
  %25 = mul i64 %.1094.0625.i.i, 24
  %26 = getelementptr i8, ptr %.44.i.i.i, i64 %25
  %.44.i623.i.i = getelementptr i8, ptr %26, i64 96
  %.45.i.i.i = fpext float %.1243.i.i to double
  store double %.45.i.i.i, ptr %.44.i623.i.i, align 8, !alias.scope !75, !noalias !78
  %.72.i.i.i = getelementptr i8, ptr %26, i64 104
  %.73.i.i.i = fpext float %.1302.i.i to double
  store double %.73.i.i.i, ptr %.72.i.i.i, align 8, !alias.scope !75, !noalias !78
  %.100.i.i.i = getelementptr i8, ptr %26, i64 112
  %.101.i.i.i = fpext float %.1359.i.i to double
  store double %.101.i.i.i, ptr %.100.i.i.i, align 8, !alias.scope !75, !noalias !78
  %.1150.i.i = icmp ugt i64 %.1097.0626.i.i, 1
  br i1 %.1150.i.i, label %B1060.if.i.i, label %B276.i

B276.i:
  %number.4.2.i = phi i64 [ %number.2.0307.i, %B150.i ], [ %.554.i, %depth_plane.2.exit.i.i ], [ %.554.i, %B738.i.i ], [ %.554.i, %B1060.if.i.i ]
  %slot.2.2.off0.i = phi i32 [ %.509.i, %B150.i ], [ %.551.i, %depth_plane.2.exit.i.i ], [ %.551.i, %B738.i.i ], [ %.551.i, %B1060.if.i.i ]
  store i32 %slot.2.2.off0.i, ptr %27, align 4, !alias.scope !1, !noalias !80
  br label %B289.i

B289.i:
  %number.3.1.i = phi i64 [ %number.4.2.i, %B276.i ], [ %number.2.0307.i, %B116.if.i ]
  %.384.i = icmp ugt i64 %.331.0306.i, 1
  br i1 %.384.i, label %B116.if.i, label %visible.2.exit

B116.if.i:
  %number.2.0307.i = phi i64 [ %number.3.1.i, %B289.i ], [ 0, %B56.i ]
  %.331.0306.i = phi i64 [ %.393.i, %B289.i ], [ %arg.ids.5.0, %B56.i ]
  %.328.0305.i = phi i64 [ %.397.i, %B289.i ], [ 0, %B56.i ]
  %.393.i = add nsw i64 %.331.0306.i, -1
  %.397.i = add nuw nsw i64 %.328.0305.i, 1
  %27 = getelementptr i32, ptr %arg.ids.4, i64 %.328.0305.i
  %.455.i = load i32, ptr %27, align 4, !alias.scope !1, !noalias !80
  %.460.i = sext i32 %.455.i to i64
  %.461.i = icmp slt i32 %.455.i, 0
  br i1 %.461.i, label %B289.i, label %B150.i

visible.2.exit:
  %.3508 = sub nsw i64 %.11.i1408, %quot.1.0
  tail call void %.3535(ptr %arg.context.4, ptr %arg.ids.4, ptr %arg.table.4, i64 %rem.01448, i64 %quot.1.0, i64 %.3508)
  br label %B3008

B3008:
  %.236 = atomicrmw add ptr %arg.counter.4, i64 1 monotonic, align 8
  %.242.not = icmp slt i64 %.236, %arg.count
  br i1 %.242.not, label %B148, label %B144

B148.else.if:
  %28 = or i64 %.336, %arg.tiles_x
  %29 = icmp ult i64 %28, 4294967296
  br i1 %29, label %30, label %34

30:
  %31 = trunc i64 %.336 to i32
  %32 = urem i32 %31, %0
  %33 = zext i32 %32 to i64
  br label %B148.endif.else.if

34:
  %35 = srem i64 %.336, %arg.tiles_x
  br label %B148.endif.else.if

B148.endif.endif:
  %rem.01448 = phi i64 [ 0, %B148 ], [ %37, %49 ]
  %quot.1.0 = phi i64 [ 0, %B148 ], [ %52, %49 ]
  %.435 = add nsw i64 %rem.01448, 64
  %.11.i1407 = tail call i64 @llvm.smin.i64(i64 %.435, i64 %arg.width)
  %.468 = add nsw i64 %quot.1.0, 64
  %.11.i1408 = tail call i64 @llvm.smin.i64(i64 %.468, i64 %arg.height)
  %.515 = shl nsw i64 %quot.1.0, 6
  %.517 = add nsw i64 %.515, %rem.01448
  %"$phi406.0.2.sroa.8.1" = select i1 %.505.not, i64 %.517, i64 0
  br i1 %.540, label %B426, label %B602.else.endif

B148.endif.else.if:
  %36 = phi i64 [ %33, %30 ], [ %35, %34 ]
  %.364 = xor i64 %36, %arg.tiles_x
  %.365 = icmp slt i64 %.364, 0
  %.366 = icmp ne i64 %36, 0
  %.367 = and i1 %.366, %.365
  %.374 = select i1 %.367, i64 %arg.tiles_x, i64 0
  %spec.select = add i64 %.374, %36
  %37 = shl nsw i64 %spec.select, 6
  %38 = or i64 %.336, %arg.tiles_x
  %39 = icmp ult i64 %38, 4294967296
  br i1 %39, label %40, label %46

40:
  %41 = trunc i64 %.336 to i32
  %42 = udiv i32 %41, %0
  %43 = urem i32 %41, %0
  %44 = zext i32 %42 to i64
  %45 = zext i32 %43 to i64
  br label %49

46:
  %47 = sdiv i64 %.336, %arg.tiles_x
  %48 = srem i64 %.336, %arg.tiles_x
  br label %49

49:
  %50 = phi i64 [ %44, %40 ], [ %47, %46 ]
  %51 = phi i64 [ %45, %40 ], [ %48, %46 ]
  %.407 = xor i64 %51, %arg.tiles_x
  %.408 = icmp slt i64 %.407, 0
  %.409 = icmp ne i64 %51, 0
  %.410 = and i1 %.409, %.408
  %.415 = sext i1 %.410 to i64
  %spec.select1403 = add i64 %50, %.415
  %52 = shl nsw i64 %spec.select1403, 6
  br label %B148.endif.endif

B458.if:
  %.567.01461 = phi i64 [ %quot.1.0, %B458.if.lr.ph ], [ %.636, %B458.loopexit ]
  %.570.01460 = phi i64 [ %.580, %B458.if.lr.ph ], [ %.632, %B458.loopexit ]
  %.632 = add nsw i64 %.570.01460, -1
  %.636 = add i64 %.567.01461, 1
  br i1 %.7451456.not, label %B458.loopexit, label %B494.if.lr.ph

B494.if.lr.ph:
  %53 = mul nsw i64 %.567.01461, %"$phi406.0.2.sroa.0.1"
  %.788 = sub i64 %53, %"$phi406.0.2.sroa.8.1"
  %54 = getelementptr float, ptr %arg.depth.4, i64 %.788
  br label %B494.if

B494.if:
  %.689.01458 = phi i64 [ %rem.01448, %B494.if.lr.ph ], [ %.758, %B494.if ]
  %.692.01457 = phi i64 [ %spec.select1452, %B494.if.lr.ph ], [ %.754, %B494.if ]
  %.754 = add nsw i64 %.692.01457, -1
  %.758 = add i64 %.689.01458, 1
  %.816 = getelementptr float, ptr %54, i64 %.689.01458
  store float %.784, ptr %.816, align 4
  %.745 = icmp sgt i64 %.692.01457, 1
  br i1 %.745, label %B494.if, label %B458.loopexit

B602.else.endif:
  br i1 %.1018, label %.1084.if, label %.1084.endif.preheader, !prof !81

.1084.endif.preheader:
  tail call void @llvm.memset.p0.i64(ptr align 4 %arg.ids.4, i8 -1, i64 %1, i1 false)
  br label %.1084.if

.1084.if:
  %.1145 = icmp slt i64 %.336, 0
  %.1146 = select i1 %.1145, i64 %arg.offsets.5.0, i64 0
  %55 = getelementptr i64, ptr %arg.offsets.4, i64 %.336
  %.1160 = getelementptr i64, ptr %55, i64 %.1146
  %.1161 = load i64, ptr %.1160, align 8
  %.1179 = icmp slt i64 %.336, -1
  %.1180 = select i1 %.1179, i64 %arg.offsets.5.0, i64 0
  %56 = getelementptr i8, ptr %55, i64 8
  %.1194 = getelementptr i64, ptr %56, i64 %.1180
  %.1195 = load i64, ptr %.1194, align 8
  %.1240 = sub i64 %.1195, %.1161
  %.1241 = icmp sgt i64 %.1240, 0
  br i1 %.1241, label %B688.if.lr.ph, label %B2890.thread

B688.if.lr.ph:
  %.2189 = add nsw i64 %.11.i1407, -1
  %.2275 = add nsw i64 %.11.i1408, -1
  br label %B688.if

B688.if:
  %.1227.01484 = phi i64 [ %.1161, %B688.if.lr.ph ], [ %.1297, %B686.loopexit ]
  %.1230.01483 = phi i64 [ %.1240, %B688.if.lr.ph ], [ %.1293, %B686.loopexit ]
  %.1293 = add nsw i64 %.1230.01483, -1
  %.1297 = add i64 %.1227.01484, 1
  tail call void @llvm.experimental.noalias.scope.decl(metadata !82)
  tail call void @llvm.experimental.noalias.scope.decl(metadata !85)
  %.107.i = add nsw i64 %.1227.01484, 8
  %.108.i = icmp slt i64 %.107.i, %.1195
  br i1 %.108.i, label %B38.i, label %soon.2.exit

B38.i:
  %.126.i = icmp slt i64 %.1227.01484, -8
  %.127.i = select i1 %.126.i, i64 %arg.lists.5.0, i64 0
  %57 = getelementptr i32, ptr %arg.lists.4, i64 %.107.i
  %.141.i = getelementptr i32, ptr %57, i64 %.127.i
  %.142.i = load i32, ptr %.141.i, align 4, !alias.scope !82, !noalias !87
  %.143.i = sext i32 %.142.i to i64
  %.155.i = mul i64 %arg.made.6.0, %.143.i
  %.156.i = add i64 %.155.i, %.154.i
  %.157.i = inttoptr i64 %.156.i to ptr
  tail call void @llvm.prefetch.p0(ptr %.157.i, i32 0, i32 3, i32 1), !noalias !92
  %.176.i = icmp slt i64 %.1227.01484, -4
  %.177.i = select i1 %.176.i, i64 %arg.lists.5.0, i64 0
  %58 = getelementptr i32, ptr %arg.lists.4, i64 %.1227.01484
  %59 = getelementptr i8, ptr %58, i64 16
  %.191.i = getelementptr i32, ptr %59, i64 %.177.i
  %.192.i = load i32, ptr %.191.i, align 4, !alias.scope !82, !noalias !87
  %.323.i = sext i32 %.192.i to i64
  %.345.i = icmp slt i32 %.192.i, 0
  %.346.i = select i1 %.345.i, i64 %arg.made.5.0, i64 0
  %.347.i = add i64 %.346.i, %.323.i
  %.367.i = mul i64 %.347.i, %arg.made.5.1
  %60 = getelementptr i32, ptr %arg.made.4, i64 %.367.i
  br label %B202.if.i

B202.if.i:
  %.224.0276.i = phi i64 [ 3, %B38.i ], [ %.288.i, %B202.if.i ]
  %.221.0275.i = phi i64 [ 0, %B38.i ], [ %.292.i, %B202.if.i ]
  %.288.i = add nsw i64 %.224.0276.i, -1
  %.292.i = add nuw nsw i64 %.221.0275.i, 1
  %61 = getelementptr i32, ptr %60, i64 %.221.0275.i
  %.372.i = load i32, ptr %61, align 4, !alias.scope !85, !noalias !92
  %.373.i = sext i32 %.372.i to i64
  %.389.i = mul i64 %arg.wx.6.0, %.373.i
  %.390.i = add i64 %.389.i, %.388.i
  %.391.i = inttoptr i64 %.390.i to ptr
  tail call void @llvm.prefetch.p0(ptr %.391.i, i32 0, i32 3, i32 1), !noalias !93
  %.405.i = mul i64 %arg.wy.6.0, %.373.i
  %.406.i = add i64 %.405.i, %.404.i
  %.407.i = inttoptr i64 %.406.i to ptr
  tail call void @llvm.prefetch.p0(ptr %.407.i, i32 0, i32 3, i32 1), !noalias !93
  %.421.i = mul i64 %arg.wz.6.0, %.373.i
  %.422.i = add i64 %.421.i, %.420.i
  %.423.i = inttoptr i64 %.422.i to ptr
  tail call void @llvm.prefetch.p0(ptr %.423.i, i32 0, i32 3, i32 1), !noalias !93
  %.279.i = icmp ugt i64 %.224.0276.i, 1
  br i1 %.279.i, label %B202.if.i, label %soon.2.exit

soon.2.exit:
  %.1392 = icmp slt i64 %.1227.01484, 0
  %.1393 = select i1 %.1392, i64 %arg.lists.5.0, i64 0
  %62 = getelementptr i32, ptr %arg.lists.4, i64 %.1227.01484
  %.1407 = getelementptr i32, ptr %62, i64 %.1393
  %.1408 = load i32, ptr %.1407, align 4
  %.1414 = sext i32 %.1408 to i64
  %.1436 = icmp slt i32 %.1408, 0
  %.1437 = select i1 %.1436, i64 %arg.made.5.0, i64 0
  %.1438 = add i64 %.1437, %.1414
  %.1458 = mul i64 %.1438, %arg.made.5.1
  %.1462 = getelementptr i32, ptr %arg.made.4, i64 %.1458
  %.1463 = load i32, ptr %.1462, align 4
  %.1809 = sext i32 %.1463 to i64
  %.1517 = getelementptr i8, ptr %.1462, i64 4
  %.1518 = load i32, ptr %.1517, align 4
  %.1840 = sext i32 %.1518 to i64
  %.1572 = getelementptr i8, ptr %.1462, i64 8
  %.1573 = load i32, ptr %.1572, align 4
  %.1871 = sext i32 %.1573 to i64
  %.1589 = icmp slt i32 %.1463, 0
  %.1590 = select i1 %.1589, i64 %arg.wx.5.0, i64 0
  %63 = getelementptr i32, ptr %arg.wx.4, i64 %.1590
  %.1604 = getelementptr i32, ptr %63, i64 %.1809
  %.1605 = load i32, ptr %.1604, align 4
  %.1621 = select i1 %.1589, i64 %arg.wy.5.0, i64 0
  %64 = getelementptr i32, ptr %arg.wy.4, i64 %.1621
  %.1635 = getelementptr i32, ptr %64, i64 %.1809
  %.1636 = load i32, ptr %.1635, align 4
  %.1651 = icmp slt i32 %.1518, 0
  %.1652 = select i1 %.1651, i64 %arg.wx.5.0, i64 0
  %65 = getelementptr i32, ptr %arg.wx.4, i64 %.1652
  %.1666 = getelementptr i32, ptr %65, i64 %.1840
  %.1667 = load i32, ptr %.1666, align 4
  %.1683 = select i1 %.1651, i64 %arg.wy.5.0, i64 0
  %66 = getelementptr i32, ptr %arg.wy.4, i64 %.1683
  %.1697 = getelementptr i32, ptr %66, i64 %.1840
  %.1698 = load i32, ptr %.1697, align 4
  %.1713 = icmp slt i32 %.1573, 0
  %.1714 = select i1 %.1713, i64 %arg.wx.5.0, i64 0
  %67 = getelementptr i32, ptr %arg.wx.4, i64 %.1714
  %.1728 = getelementptr i32, ptr %67, i64 %.1871
  %.1729 = load i32, ptr %.1728, align 4
  %.1745 = select i1 %.1713, i64 %arg.wy.5.0, i64 0
  %68 = getelementptr i32, ptr %arg.wy.4, i64 %.1745
  %.1759 = getelementptr i32, ptr %68, i64 %.1871
  %.1760 = load i32, ptr %.1759, align 4
  %.10.i1409 = sext i32 %.1605 to i64
  %.11.i1410 = sext i32 %.1636 to i64
  %.12.i = sext i32 %.1667 to i64
  %.13.i = sub nsw i64 %.12.i, %.10.i1409
  %.14.i = sext i32 %.1698 to i64
  %.15.i = sub nsw i64 %.14.i, %.11.i1410
  %.16.i = sext i32 %.1729 to i64
  %.17.i = sub nsw i64 %.16.i, %.10.i1409
  %.18.i = sext i32 %.1760 to i64
  %.19.i = sub nsw i64 %.18.i, %.11.i1410
  %.1798 = mul nsw i64 %.19.i, %.13.i
  %.1800 = mul nsw i64 %.17.i, %.15.i
  %.1801 = sub nsw i64 %.1798, %.1800
  %.1802 = sitofp i64 %.1801 to double
  %.1806 = fdiv double 2.560000e+02, %.1802
  %.1823 = select i1 %.1589, i64 %arg.wz.5.0, i64 0
  %69 = getelementptr double, ptr %arg.wz.4, i64 %.1823
  %.1837 = getelementptr double, ptr %69, i64 %.1809
  %.1838 = load double, ptr %.1837, align 8
  %.1854 = select i1 %.1651, i64 %arg.wz.5.0, i64 0
  %70 = getelementptr double, ptr %arg.wz.4, i64 %.1854
  %.1868 = getelementptr double, ptr %70, i64 %.1840
  %.1869 = load double, ptr %.1868, align 8
  %.1885 = select i1 %.1713, i64 %arg.wz.5.0, i64 0
  %71 = getelementptr double, ptr %arg.wz.4, i64 %.1885
  %.1899 = getelementptr double, ptr %71, i64 %.1871
  %.1900 = load double, ptr %.1899, align 8
  %.12.i.i = fsub double %.1869, %.1838
  %.13.i.i = sitofp i64 %.19.i to double
  %.14.i.i = fmul double %.12.i.i, %.13.i.i
  %.15.i.i = fsub double %.1900, %.1838
  %.16.i.i = sitofp i64 %.15.i to double
  %.17.i.i = fmul double %.15.i.i, %.16.i.i
  %.18.i.i = fsub double %.14.i.i, %.17.i.i
  %.19.i.i = fmul double %.1806, %.18.i.i
  %.21.i.i = sitofp i64 %.13.i to double
  %.22.i.i = fmul double %.15.i.i, %.21.i.i
  %.24.i.i = sitofp i64 %.17.i to double
  %.25.i.i = fmul double %.12.i.i, %.24.i.i
  %.26.i.i = fsub double %.22.i.i, %.25.i.i
  %.27.i.i1411 = fmul double %.1806, %.26.i.i
  br i1 %or.cond.i, label %B80.i, label %depth_plane.2.exit

B80.i:
  %.79.i = tail call double @llvm.fabs.f64(double %.1838)
  %.83.i = tail call double @llvm.fabs.f64(double %.1869)
  %.87.i = tail call double @llvm.fabs.f64(double %.1900)
  %.13.i10.i = fcmp ogt double %.83.i, %.79.i
  %.14.i11.i = select i1 %.13.i10.i, double %.83.i, double %.79.i
  %.15.i12.i = fcmp ogt double %.87.i, %.14.i11.i
  %.16.i13.i = select i1 %.15.i12.i, double %.87.i, double %.14.i11.i
  %.124.i = fcmp ogt double %.16.i13.i, 0.000000e+00
  br i1 %.124.i, label %for.body.i, label %B294.i

B294.i:
  %"$phi294.0.2.0.i" = phi double [ %exp2.i, %for.body.i ], [ 0.000000e+00, %B80.i ]
  %.168.i = tail call double @llvm.fabs.f64(double %.19.i.i)
  %.170.i = tail call double @llvm.fabs.f64(double %.27.i.i1411)
  %.10.i.i = fcmp ogt double %.170.i, %.168.i
  %.11.i.i = select i1 %.10.i.i, double %.170.i, double %.168.i
  %.200.i = fmul double %arg.factor, %.11.i.i
  %.204.i = fmul double %arg.units, %"$phi294.0.2.0.i"
  %.207.i = fadd double %.200.i, %.204.i
  %.209.i = fadd double %.1838, %.207.i
  br label %depth_plane.2.exit

for.body.i:
  %.134.le.i = tail call double @llvm.log2.f64(double %.16.i13.i)
  %.148.le.i = tail call double @llvm.floor.f64(double %.134.le.i)
  %.153.i = fadd double %.148.le.i, -2.300000e+01
  %exp2.i = tail call double @llvm.exp2.f64(double %.153.i)
  br label %B294.i

depth_plane.2.exit:
  %start.2.1.i = phi double [ %.209.i, %B294.i ], [ %.1838, %soon.2.exit ]
  %.1938 = sitofp i32 %.1636 to double
  %.1942 = fmul double %.1938, 3.906250e-03
  %.1943 = fsub double 5.000000e-01, %.1942
  %.1947 = sitofp i32 %.1605 to double
  %.1951 = fmul double %.1947, 3.906250e-03
  %.1952 = fsub double 5.000000e-01, %.1951
  %.1954 = fmul double %.1952, %.19.i.i
  %.1955 = fadd double %.1954, %start.2.1.i
  %.2012 = getelementptr i8, ptr %.1462, i64 16
  %.2013 = load i32, ptr %.2012, align 4
  %.2014 = sext i32 %.2013 to i64
  %.11.i1412 = tail call i64 @llvm.smax.i64(i64 %rem.01448, i64 %.2014)
  %.2097 = getelementptr i8, ptr %.1462, i64 20
  %.2098 = load i32, ptr %.2097, align 4
  %.2099 = sext i32 %.2098 to i64
  %.11.i1413 = tail call i64 @llvm.smax.i64(i64 %quot.1.0, i64 %.2099)
  %.2185 = getelementptr i8, ptr %.1462, i64 24
  %.2186 = load i32, ptr %.2185, align 4
  %.2187 = sext i32 %.2186 to i64
  %.11.i1414 = tail call i64 @llvm.smin.i64(i64 %.2189, i64 %.2187)
  %.2271 = getelementptr i8, ptr %.1462, i64 28
  %.2272 = load i32, ptr %.2271, align 4
  %.2273 = sext i32 %.2272 to i64
  %.11.i1415 = tail call i64 @llvm.smin.i64(i64 %.2275, i64 %.2273)
  %.neg = mul nsw i64 %.15.i, -256
  %.2404.neg = sub nsw i64 %.15.i, %.19.i
  %.2406 = shl nsw i64 %.2404.neg, 8
  %.2407 = shl nsw i64 %.19.i, 8
  %reass.sub1489 = sub i64 %.11.i1415, %.11.i1413
  %.24981473.not = icmp ugt i64 %reass.sub1489, 9223372036854775806
  br i1 %.24981473.not, label %B686.loopexit, label %B1724.if.lr.ph

B1724.if.lr.ph:
  %.2454 = add nuw nsw i64 %reass.sub1489, 1
  %invariant.op = add nsw i64 %.11.i1414, 1
  %.2308 = shl nsw i64 %.11.i1412, 8
  %reass.sub = sub i64 %.2308, %.10.i1409
  %.2310 = add i64 %reass.sub, 128
  %.21.neg.neg.i = sub i64 %.2310, %.17.i
  %.23.neg.i1435 = mul i64 %.21.neg.neg.i, %.19.i
  %.26.i1428 = icmp slt i64 %.19.i, 1
  %.32.i1429 = icmp ne i32 %.1760, %.1636
  %.37.i1430 = icmp sgt i64 %.17.i, -1
  %or.cond.not.i1431 = select i1 %.32.i1429, i1 true, i1 %.37.i1430
  %narrow.i1432 = select i1 %.26.i1428, i1 %or.cond.not.i1431, i1 false
  %"$phi98.1.2.0.neg.i1433" = sext i1 %narrow.i1432 to i64
  %.24.i1436 = add i64 %.23.neg.i1435, %"$phi98.1.2.0.neg.i1433"
  %.2311 = shl nsw i64 %.11.i1413, 8
  %reass.sub1488 = sub i64 %.2311, %.11.i1410
  %.2313 = add i64 %reass.sub1488, 128
  %.18.neg.i = sub i64 %.19.i, %.2313
  %.20.i1434 = mul i64 %.18.neg.i, %.17.i
  %.56.i1437 = add i64 %.24.i1436, %.20.i1434
  %.21.neg.i = sub i64 %.13.i, %.2310
  %.11.i1417 = sub nsw i64 %.19.i, %.15.i
  %.23.neg.i = mul i64 %.21.neg.i, %.11.i1417
  %.26.i1418 = icmp sgt i64 %.11.i1417, -1
  %.32.i1419 = icmp ne i32 %.1760, %.1698
  %.10.i1416 = sub nsw i64 %.17.i, %.13.i
  %.37.i1420 = icmp slt i64 %.10.i1416, 1
  %or.cond.not.i1421 = select i1 %.32.i1419, i1 true, i1 %.37.i1420
  %narrow.i1422 = select i1 %.26.i1418, i1 %or.cond.not.i1421, i1 false
  %"$phi98.1.2.0.neg.i1423" = sext i1 %narrow.i1422 to i64
  %.24.i1426 = add i64 %.23.neg.i, %"$phi98.1.2.0.neg.i1423"
  %.18.i1424 = sub nsw i64 %.2313, %.15.i
  %.20.i1425 = mul nsw i64 %.18.i1424, %.10.i1416
  %.56.i1427 = add i64 %.24.i1426, %.20.i1425
  %.26.i = icmp sgt i64 %.15.i, -1
  %.32.i = icmp ne i32 %.1698, %.1636
  %.37.i = icmp slt i64 %.13.i, 1
  %or.cond.not.i = select i1 %.32.i, i1 true, i1 %.37.i
  %narrow.i = select i1 %.26.i, i1 %or.cond.not.i, i1 false
  %"$phi98.1.2.0.neg.i" = sext i1 %narrow.i to i64
  %.23.i = mul nsw i64 %.2310, %.15.i
  %.24.i = sub i64 %"$phi98.1.2.0.neg.i", %.23.i
  %.20.i = mul nsw i64 %.2313, %.13.i
  %.56.i = add i64 %.24.i, %.20.i
  %.2563 = sub nsw i64 %.11.i1414, %.11.i1412
  %.2564 = icmp slt i64 %.2563, 8
  %.20.i.i = icmp slt i64 %.15.i, 0
  %.144.i.i.not = icmp eq i32 %.1698, %.1636
  %.152.i.i = sub nsw i64 0, %.neg
  %.157.i.i = sitofp i64 %.152.i.i to double
  %.131.i.i = add nsw i64 %.11.i1412, -1
  %.35.i.i = uitofp i64 %.neg to double
  %.20.i15.i = icmp sgt i64 %.2404.neg, 0
  %.144.i19.i = icmp slt i64 %.2404.neg, 0
  %.152.i24.i = sub nsw i64 0, %.2406
  %.157.i26.i = sitofp i64 %.152.i24.i to double
  %.35.i38.i = uitofp i64 %.2406 to double
  %.20.i45.i = icmp sgt i64 %.19.i, 0
  %.144.i49.i = icmp slt i64 %.19.i, 0
  %.152.i54.i = sub nsw i64 0, %.2407
  %.157.i56.i = sitofp i64 %.152.i54.i to double
  %.35.i68.i = uitofp i64 %.2407 to double
  %.3254 = sub nsw i64 %.1227.01484, %.1161
  %extract.t = trunc i64 %.3254 to i32
  %.2617.reass = sub i64 %invariant.op, %.11.i1412
  %spec.select1450 = tail call i64 @llvm.smax.i64(i64 %.2617.reass, i64 0)
  %.26601467.not = icmp slt i64 %.2617.reass, 1
  %.3370 = shl nsw i64 %.13.i, 8
  %.3376 = shl nsw i64 %.10.i1416, 8
  %.3380 = shl nsw i64 %.17.i, 8
  br label %B1724.if

B1724.if:
  %e0.2.21480 = phi i64 [ %.56.i, %B1724.if.lr.ph ], [ %.3372, %B2828 ]
  %e1.2.21478 = phi i64 [ %.56.i1427, %B1724.if.lr.ph ], [ %.3378, %B2828 ]
  %e2.2.21476 = phi i64 [ %.56.i1437, %B1724.if.lr.ph ], [ %.3382, %B2828 ]
  %.2444.01475 = phi i64 [ %.2454, %B1724.if.lr.ph ], [ %.2507, %B2828 ]
  %.2441.01474 = phi i64 [ %.11.i1413, %B1724.if.lr.ph ], [ %.2511, %B2828 ]
  %.2507 = add nsw i64 %.2444.01475, -1
  %.2511 = add i64 %.2441.01474, 1
  %.2537 = sitofp i64 %.2441.01474 to double
  %.2538 = fadd double %.1943, %.2537
  %.2540 = fmul double %.27.i.i1411, %.2538
  %.2542 = fadd double %.1955, %.2540
  %.2544 = mul nsw i64 %.2441.01474, %"$phi406.0.2.sroa.0.1"
  %.2546 = sub nsw i64 %.2544, %"$phi406.0.2.sroa.8.1"
  %.2548 = sub nsw i64 %.2441.01474, %quot.1.0
  %.2549 = shl nsw i64 %.2548, 6
  %.2551 = sub nsw i64 %.2549, %rem.01448
  br i1 %.2564, label %B1826, label %B2294

B1876.if:
  %i0.2.31472 = phi i64 [ %e0.2.21480, %B1876.if.lr.ph ], [ %.2909, %B2258 ]
  %i1.2.31471 = phi i64 [ %e1.2.21478, %B1876.if.lr.ph ], [ %.2912, %B2258 ]
  %i2.2.31470 = phi i64 [ %e2.2.21476, %B1876.if.lr.ph ], [ %.2915, %B2258 ]
  %.2607.01469 = phi i64 [ %spec.select1450, %B1876.if.lr.ph ], [ %.2669, %B2258 ]
  %.2604.01468 = phi i64 [ %.11.i1412, %B1876.if.lr.ph ], [ %.2673, %B2258 ]
  %.2669 = add nsw i64 %.2607.01469, -1
  %.2673 = add i64 %.2604.01468, 1
  %.2703 = or i64 %i1.2.31471, %i2.2.31470
  %.2705 = or i64 %.2703, %i0.2.31472
  %.2706 = icmp sgt i64 %.2705, -1
  br i1 %.2706, label %B1904, label %B2258

B2382.if:
  %.3002.01466 = phi i64 [ %.3012, %B2382.if.lr.ph ], [ %.3064, %B2710 ]
  %.2999.01465 = phi i64 [ %first.2.0.i50.i, %B2382.if.lr.ph ], [ %.3068, %B2710 ]
  %.3064 = add nsw i64 %.3002.01466, -1
  %.3068 = add i64 %.2999.01465, 1
  %.3097 = sitofp i64 %.2999.01465 to double
  %.3099 = fmul double %.19.i.i, %.3097
  %.3101 = fadd double %.2542, %.3099
  %.10.i1438 = fcmp olt double %.3101, 0.000000e+00
  %.11.i1439 = select i1 %.10.i1438, double 0.000000e+00, double %.3101
  %.10.i1440 = fcmp ogt double %.11.i1439, 1.000000e+00
  %.11.i1441 = select i1 %.10.i1440, double 1.000000e+00, double %.11.i1439
  %.3158 = fptrunc double %.11.i1441 to float
  %.3190 = getelementptr float, ptr %5, i64 %.2999.01465
  %.3191 = load float, ptr %.3190, align 4
  %.3220 = getelementptr i32, ptr %6, i64 %.2999.01465
  %.3230 = fcmp ogt float %.3191, %.3158
  %.3232 = and i1 %.210, %.3230
  %.3235 = fcmp oeq float %.3191, %.3158
  %.3237 = and i1 %.212, %.3235
  %.3238 = or i1 %.3232, %.3237
  %.3241 = fcmp olt float %.3191, %.3158
  %.3243 = and i1 %.214, %.3241
  %.3244 = or i1 %.3243, %.3238
  br i1 %.3244, label %B2710, label %B2708
}

declare void @llvm.prefetch.p0(ptr, i32, i32, i32)

declare double @llvm.fabs.f64(double)

declare double @llvm.log2.f64(double)

declare double @llvm.floor.f64(double)

declare double @llvm.ceil.f64(double)

declare i64 @llvm.smin.i64(i64, i64)

declare double @llvm.exp2.f64(double)

declare i64 @llvm.smax.i64(i64, i64)

declare void @llvm.experimental.noalias.scope.decl(metadata)

declare void @llvm.memset.p0.i64(ptr, i8, i64, i1)

!0 = !{!"branch_weights", i32 9801, i32 199}
!1 = !{!2}
!2 = distinct !{!2, !3, !"visible.2: %arg.ids.4"}
!3 = distinct !{!3, !"visible.2"}
!4 = !{!5}
!5 = distinct !{!5, !3, !"visible.2: %arg.slots.4"}
!6 = !{!7}
!7 = distinct !{!7, !3, !"visible.2: %arg.lists.4"}
!8 = !{!9}
!9 = distinct !{!9, !3, !"visible.2: %arg.made.4"}
!10 = !{!11}
!11 = distinct !{!11, !3, !"visible.2: %arg.window_x.4"}
!12 = !{!13}
!13 = distinct !{!13, !3, !"visible.2: %arg.window_y.4"}
!14 = !{!15}
!15 = distinct !{!15, !3, !"visible.2: %arg.depth.4"}
!16 = !{!17}
!17 = distinct !{!17, !3, !"visible.2: %arg.inverse_w.4"}
!18 = !{!19}
!19 = distinct !{!19, !3, !"visible.2: %arg.varyings.4"}
!20 = !{!21}
!21 = distinct !{!21, !3, !"visible.2: %arg.table.4"}
!22 = !{!23, !2, !7, !9, !11, !13, !15, !17, !19, !21}
!23 = distinct !{!23, !3, !"visible.2: %retptr"}
!24 = !{!23, !2, !5, !9, !11, !13, !15, !17, !19, !21}
!25 = !{!26}
!26 = distinct !{!26, !27, !"numbered.2: %arg.made.4"}
!27 = distinct !{!27, !"numbered.2"}
!28 = !{!29}
!29 = distinct !{!29, !27, !"numbered.2: %arg.window_x.4"}
!30 = !{!31}
!31 = distinct !{!31, !27, !"numbered.2: %arg.window_y.4"}
!32 = !{!33}
!33 = distinct !{!33, !27, !"numbered.2: %arg.depth.4"}
!34 = !{!35}
!35 = distinct !{!35, !27, !"numbered.2: %arg.inverse_w.4"}
!36 = !{!37}
!37 = distinct !{!37, !27, !"numbered.2: %arg.varyings.4"}
!38 = !{!39}
!39 = distinct !{!39, !27, !"numbered.2: %arg.table.4"}
!40 = !{!26, !9}
!41 = !{!42, !29, !31, !33, !35, !37, !39, !23, !2, !5, !7, !11, !13, !15, !17, !19, !21}
!42 = distinct !{!42, !27, !"numbered.2: %retptr"}
!43 = !{!29, !11}
!44 = !{!42, !26, !31, !33, !35, !37, !39, !23, !2, !5, !7, !9, !13, !15, !17, !19, !21}
!45 = !{!31, !13}
!46 = !{!42, !26, !29, !33, !35, !37, !39, !23, !2, !5, !7, !9, !11, !15, !17, !19, !21}
!47 = !{!39, !21}
!48 = !{!42, !26, !29, !31, !33, !35, !37, !23, !2, !5, !7, !9, !11, !13, !15, !17, !19}
!49 = !{!33, !15}
!50 = !{!42, !26, !29, !31, !35, !37, !39, !23, !2, !5, !7, !9, !11, !13, !17, !19, !21}
!51 = !{!52, !39, !21}
!52 = distinct !{!52, !53, !"put.8: %arg.table.4"}
!53 = distinct !{!53, !"put.8"}
!54 = !{!55, !42, !26, !29, !31, !33, !35, !37, !23, !2, !5, !7, !9, !11, !13, !15, !17, !19}
!55 = distinct !{!55, !53, !"put.8: %retptr"}
!56 = !{!57, !39, !21}
!57 = distinct !{!57, !58, !"put.6: %arg.table.4"}
!58 = distinct !{!58, !"put.6"}
!59 = !{!60, !42, !26, !29, !31, !33, !35, !37, !23, !2, !5, !7, !9, !11, !13, !15, !17, !19}
!60 = distinct !{!60, !58, !"put.6: %retptr"}
!61 = !{!62, !39, !21}
!62 = distinct !{!62, !63, !"put.9: %arg.table.4"}
!63 = distinct !{!63, !"put.9"}
!64 = !{!65, !42, !26, !29, !31, !33, !35, !37, !23, !2, !5, !7, !9, !11, !13, !15, !17, !19}
!65 = distinct !{!65, !63, !"put.9: %retptr"}
!66 = !{!35, !17}
!67 = !{!42, !26, !29, !31, !33, !37, !39, !23, !2, !5, !7, !9, !11, !13, !15, !19, !21}
!68 = !{!69, !39, !21}
!69 = distinct !{!69, !70, !"put.10: %arg.table.4"}
!70 = distinct !{!70, !"put.10"}
!71 = !{!72, !42, !26, !29, !31, !33, !35, !37, !23, !2, !5, !7, !9, !11, !13, !15, !17, !19}
!72 = distinct !{!72, !70, !"put.10: %retptr"}
!73 = !{!37, !19}
!74 = !{!42, !26, !29, !31, !33, !35, !39, !23, !2, !5, !7, !9, !11, !13, !15, !17, !21}
!75 = !{!76, !39, !21}
!76 = distinct !{!76, !77, !"put.7: %arg.table.4"}
!77 = distinct !{!77, !"put.7"}
!78 = !{!79, !42, !26, !29, !31, !33, !35, !37, !23, !2, !5, !7, !9, !11, !13, !15, !17, !19}
!79 = distinct !{!79, !77, !"put.7: %retptr"}
!80 = !{!23, !5, !7, !9, !11, !13, !15, !17, !19, !21}
!81 = !{!"branch_weights", i32 1, i32 99}
!82 = !{!83}
!83 = distinct !{!83, !84, !"soon.2: %arg.lists.4"}
!84 = distinct !{!84, !"soon.2"}
!85 = !{!86}
!86 = distinct !{!86, !84, !"soon.2: %arg.made.4"}
!87 = !{!88, !86, !89, !90, !91}
!88 = distinct !{!88, !84, !"soon.2: %retptr"}
!89 = distinct !{!89, !84, !"soon.2: %arg.window_x.4"}
!90 = distinct !{!90, !84, !"soon.2: %arg.window_y.4"}
!91 = distinct !{!91, !84, !"soon.2: %arg.depth.4"}
!92 = !{!88, !83, !89, !90, !91}
!93 = !{!88, !83}
