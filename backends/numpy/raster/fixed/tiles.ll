; Sources 2639d72187b2918dbff16475bd51279b01cbd8b80833b084118f22b0e69242ce
; Made by `python -m passgraph.backends.numpy.raster.generate`.

define internal i32 @tiles(ptr noalias %retptr, ptr noalias %excinfo, ptr noalias %arg.counter.0, ptr noalias %arg.counter.1, i64 %arg.counter.2, i64 %arg.counter.3, ptr noalias %arg.counter.4, i64 %arg.counter.5.0, i64 %arg.counter.6.0, i64 %arg.count, ptr noalias %arg.busy.0, ptr noalias %arg.busy.1, i64 %arg.busy.2, i64 %arg.busy.3, ptr noalias %arg.busy.4, i64 %arg.busy.5.0, i64 %arg.busy.6.0, i64 %arg.tiles_x, ptr noalias %arg.offsets.0, ptr noalias %arg.offsets.1, i64 %arg.offsets.2, i64 %arg.offsets.3, ptr noalias %arg.offsets.4, i64 %arg.offsets.5.0, i64 %arg.offsets.6.0, ptr noalias %arg.lists.0, ptr noalias %arg.lists.1, i64 %arg.lists.2, i64 %arg.lists.3, ptr noalias %arg.lists.4, i64 %arg.lists.5.0, i64 %arg.lists.6.0, ptr noalias %arg.triangles.0, ptr noalias %arg.triangles.1, i64 %arg.triangles.2, i64 %arg.triangles.3, ptr noalias %arg.triangles.4, i64 %arg.triangles.5.0, i64 %arg.triangles.5.1, i64 %arg.triangles.6.0, i64 %arg.triangles.6.1, ptr noalias %arg.wx.0, ptr noalias %arg.wx.1, i64 %arg.wx.2, i64 %arg.wx.3, ptr noalias %arg.wx.4, i64 %arg.wx.5.0, i64 %arg.wx.6.0, ptr noalias %arg.wy.0, ptr noalias %arg.wy.1, i64 %arg.wy.2, i64 %arg.wy.3, ptr noalias %arg.wy.4, i64 %arg.wy.5.0, i64 %arg.wy.6.0, ptr noalias %arg.wz.0, ptr noalias %arg.wz.1, i64 %arg.wz.2, i64 %arg.wz.3, ptr noalias %arg.wz.4, i64 %arg.wz.5.0, i64 %arg.wz.6.0, ptr noalias %arg.iw.0, ptr noalias %arg.iw.1, i64 %arg.iw.2, i64 %arg.iw.3, ptr noalias %arg.iw.4, i64 %arg.iw.5.0, i64 %arg.iw.6.0, ptr noalias %arg.vary.0, ptr noalias %arg.vary.1, i64 %arg.vary.2, i64 %arg.vary.3, ptr noalias %arg.vary.4, i64 %arg.vary.5.0, i64 %arg.vary.5.1, i64 %arg.vary.6.0, i64 %arg.vary.6.1, double %arg.factor, double %arg.units, i64 %arg.width, i64 %arg.height, ptr noalias %arg.depth.0, ptr noalias %arg.depth.1, i64 %arg.depth.2, i64 %arg.depth.3, ptr noalias %arg.depth.4, i64 %arg.depth.5.0, i64 %arg.depth.6.0, i64 %arg.has_depth, i64 %arg.test, i64 %arg.write, double %arg.clear, ptr noalias %arg.ids.0, ptr noalias %arg.ids.1, i64 %arg.ids.2, i64 %arg.ids.3, ptr noalias %arg.ids.4, i64 %arg.ids.5.0, i64 %arg.ids.6.0, ptr noalias %arg.slots.0, ptr noalias %arg.slots.1, i64 %arg.slots.2, i64 %arg.slots.3, ptr noalias %arg.slots.4, i64 %arg.slots.5.0, i64 %arg.slots.6.0, i64 %arg.rows, ptr noalias %arg.table.0, ptr noalias %arg.table.1, i64 %arg.table.2, i64 %arg.table.3, ptr noalias %arg.table.4, i64 %arg.table.5.0, i64 %arg.table.6.0, i64 %arg.shade, ptr noalias %arg.context.0, ptr noalias %arg.context.1, i64 %arg.context.2, i64 %arg.context.3, ptr noalias %arg.context.4, i64 %arg.context.5.0, i64 %arg.context.6.0) {
entry:
  %.209 = and i64 %arg.test, 1
  %.210 = icmp ne i64 %.209, 0
  %.211 = and i64 %arg.test, 2
  %.212 = icmp ne i64 %.211, 0
  %.213 = and i64 %arg.test, 4
  %.214 = icmp ne i64 %.213, 0
  %.224 = icmp ne i64 %arg.write, 0
  %.2361486 = atomicrmw add ptr %arg.counter.4, i64 1 monotonic, align 8
  %.242.not1487 = icmp slt i64 %.2361486, %arg.count
  br i1 %.242.not1487, label %B148.lr.ph, label %B144

B148.lr.ph:
  %.346 = icmp ne i64 %arg.tiles_x, 0
  %.358 = icmp ne i64 %arg.tiles_x, -1
  %0 = trunc i64 %arg.tiles_x to i32
  %.505.not = icmp eq i64 %arg.has_depth, 0
  %"$phi406.0.2.sroa.0.1" = select i1 %.505.not, i64 64, i64 %arg.width
  %.540 = fcmp ord double %arg.clear, 0.000000e+00
  %.784 = fptrunc double %arg.clear to float
  %.1018 = icmp slt i64 %arg.ids.5.0, 1
  %.151.i = ptrtoint ptr %arg.triangles.4 to i64
  %.372.i = ptrtoint ptr %arg.wx.4 to i64
  %.388.i = ptrtoint ptr %arg.wy.4 to i64
  %.404.i = ptrtoint ptr %arg.wz.4 to i64
  %.67.i = fcmp une double %arg.factor, 0.000000e+00
  %.74.i = fcmp une double %arg.units, 0.000000e+00
  %or.cond.i = select i1 %.67.i, i1 true, i1 %.74.i
  %.3373.not = icmp eq i64 %arg.shade, 0
  %.475.i.i = mul nsw i64 %arg.rows, 3
  %.476.i.i = add nsw i64 %.475.i.i, 2
  %.745.i.i = icmp sgt i64 %arg.rows, 1
  %.1085624.not.i.i = icmp slt i64 %arg.vary.5.1, 1
  %.3472 = inttoptr i64 %arg.shade to ptr
  %1 = shl i64 %arg.ids.5.0, 2
  br label %B148

B144:
  store ptr null, ptr %retptr, align 8
  ret i32 0

B148:
  %.2361488 = phi i64 [ %.2361486, %B148.lr.ph ], [ %.236, %B3188 ]
  %.320 = icmp slt i64 %.2361488, 0
  %.321 = select i1 %.320, i64 %arg.busy.5.0, i64 0
  %2 = getelementptr i64, ptr %arg.busy.4, i64 %.2361488
  %.335 = getelementptr i64, ptr %2, i64 %.321
  %.336 = load i64, ptr %.335, align 8
  %.357 = icmp ne i64 %.336, -9223372036854775808
  %.359.not = or i1 %.358, %.357
  %or.cond1498 = select i1 %.346, i1 %.359.not, i1 false, !prof !0
  br i1 %or.cond1498, label %B148.else.if, label %B148.endif.endif, !prof !0

B426:
  %.580 = sub i64 %.11.i1408, %quot.1.0
  %.6231460.not = icmp slt i64 %.580, 1
  br i1 %.6231460.not, label %B602.else.endif, label %B458.if.lr.ph

B458.if.lr.ph:
  %.702 = sub i64 %.11.i1407, %rem.01449
  %spec.select1453 = tail call i64 @llvm.smax.i64(i64 %.702, i64 0)
  %.7451457.not = icmp slt i64 %.702, 1
  br label %B458.if

B458.loopexit:
  %.623 = icmp ugt i64 %.570.01461, 1
  br i1 %.623, label %B458.if, label %B602.else.endif

B686.loopexit:
  %.1284 = icmp sgt i64 %.1230.01484, 1
  br i1 %.1284, label %B688.if, label %B3070

B2006:
  br i1 %.25971468.not, label %B3008, label %B2056.if.lr.ph

B2056.if.lr.ph:
  %3 = getelementptr float, ptr %arg.depth.4, i64 %.2483
  %4 = getelementptr i32, ptr %arg.ids.4, i64 %.2488
  br label %B2056.if

B2084:
  %.2646 = sitofp i64 %.2541.01469 to double
  %.2648 = fmul double %.19.i.i, %.2646
  %.2650 = fadd double %.2479, %.2648
  %.10.i = fcmp olt double %.2650, 0.000000e+00
  %.11.i = select i1 %.10.i, double 0.000000e+00, double %.2650
  %.10.i1404 = fcmp ogt double %.11.i, 1.000000e+00
  %.11.i1405 = select i1 %.10.i1404, double 1.000000e+00, double %.11.i
  %.2707 = fptrunc double %.11.i1405 to float
  %.2739 = getelementptr float, ptr %3, i64 %.2541.01469
  %.2740 = load float, ptr %.2739, align 4
  %.2748 = fcmp ogt float %.2740, %.2707
  %or.cond = select i1 %.210, i1 %.2748, i1 false
  %.2754 = fcmp oeq float %.2740, %.2707
  %or.cond1398 = select i1 %.212, i1 %.2754, i1 false
  %or.cond1401 = select i1 %or.cond, i1 true, i1 %or.cond1398
  %.2760 = fcmp olt float %.2740, %.2707
  %or.cond1399 = select i1 %.214, i1 %.2760, i1 false
  %or.cond1402 = select i1 %or.cond1401, i1 true, i1 %or.cond1399
  br i1 %or.cond1402, label %B2324, label %B2438

B2324:
  %.2797 = getelementptr i32, ptr %4, i64 %.2541.01469
  store i32 %extract.t, ptr %.2797, align 4
  br i1 %.224, label %B2386, label %B2438

B2386:
  store float %.2707, ptr %.2739, align 4
  br label %B2438

B2438:
  %.2846 = add nsw i64 %i0.2.31473, %.neg
  %.2849 = add nsw i64 %i1.2.31472, %.2343
  %.2852 = add nsw i64 %i2.2.31471, %.2344
  %.2597 = icmp sgt i64 %.2544.01470, 1
  br i1 %.2597, label %B2056.if, label %B3008

B2474:
  %.27.i.i = icmp slt i64 %e0.2.21481, 0
  br i1 %.20.i.i, label %B16.i.i, label %B148.i.i

B16.i.i:
  br i1 %.27.i.i, label %B28.i.i, label %narrowed.2.exit.i

B28.i.i:
  %.30.i.i = sub i64 0, %e0.2.21481
  %.34.i.i = sitofp i64 %.30.i.i to double
  %.39.i.i = fdiv double %.34.i.i, %.35.i.i
  %.49.le.i.i = tail call double @llvm.ceil.f64(double %.39.i.i)
  %.54.i.i = fptosi double %.49.le.i.i to i64
  %.56.i.i = add nsw i64 %.11.i1413, %.54.i.i
  %.11.i.i.i = tail call i64 @llvm.smax.i64(i64 %.56.i.i, i64 %.11.i1413)
  br label %narrowed.2.exit.i

B148.i.i:
  %brmerge = select i1 %.27.i.i, i1 true, i1 %.144.i.i.not
  %.131.i.i.mux = select i1 %.27.i.i, i64 %.131.i.i, i64 %.11.i1415
  br i1 %brmerge, label %narrowed.2.exit.i, label %B184.i.i

B184.i.i:
  %.156.i.i = uitofp i64 %e0.2.21481 to double
  %.161.i.i = fdiv double %.156.i.i, %.157.i.i
  %.171.le.i.i = tail call double @llvm.floor.f64(double %.161.i.i)
  %.176.i.i = fptosi double %.171.le.i.i to i64
  %.178.i.i = add nsw i64 %.11.i1413, %.176.i.i
  %.11.i55.i.i = tail call i64 @llvm.smin.i64(i64 %.178.i.i, i64 %.11.i1415)
  br label %narrowed.2.exit.i

narrowed.2.exit.i:
  %first.2.0.i.i = phi i64 [ %.11.i1413, %B148.i.i ], [ %.11.i1413, %B16.i.i ], [ %.11.i1413, %B184.i.i ], [ %.11.i.i.i, %B28.i.i ]
  %last.3.0.i.i = phi i64 [ %.131.i.i.mux, %B148.i.i ], [ %.11.i1415, %B16.i.i ], [ %.11.i55.i.i, %B184.i.i ], [ %.11.i1415, %B28.i.i ]
  %.27.i16.i = icmp slt i64 %e1.2.21479, 0
  br i1 %.20.i15.i, label %B16.i34.i, label %B148.i17.i

B16.i34.i:
  br i1 %.27.i16.i, label %B28.i35.i, label %narrowed.2.exit44.i

B28.i35.i:
  %.30.i36.i = sub i64 0, %e1.2.21479
  %.34.i37.i = sitofp i64 %.30.i36.i to double
  %.39.i39.i = fdiv double %.34.i37.i, %.35.i38.i
  %.49.le.i40.i = tail call double @llvm.ceil.f64(double %.39.i39.i)
  %.54.i41.i = fptosi double %.49.le.i40.i to i64
  %.56.i42.i = add nsw i64 %.11.i1413, %.54.i41.i
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
  %.156.i25.i = uitofp i64 %e1.2.21479 to double
  %.161.i27.i = fdiv double %.156.i25.i, %.157.i26.i
  %.171.le.i28.i = tail call double @llvm.floor.f64(double %.161.i27.i)
  %.176.i29.i = fptosi double %.171.le.i28.i to i64
  %.178.i30.i = add nsw i64 %.11.i1413, %.176.i29.i
  %.11.i55.i31.i = tail call i64 @llvm.smin.i64(i64 %.178.i30.i, i64 %last.3.0.i.i)
  br label %narrowed.2.exit44.i

narrowed.2.exit44.i:
  %first.2.0.i20.i = phi i64 [ %first.2.0.i.i, %B172.i18.i ], [ %first.2.0.i.i, %B160.i32.i ], [ %first.2.0.i.i, %B184.i23.i ], [ %.11.i.i43.i, %B28.i35.i ], [ %first.2.0.i.i, %B16.i34.i ]
  %last.3.0.i21.i = phi i64 [ %last.3.0.i.i, %B172.i18.i ], [ %.131.i33.i, %B160.i32.i ], [ %.11.i55.i31.i, %B184.i23.i ], [ %last.3.0.i.i, %B28.i35.i ], [ %last.3.0.i.i, %B16.i34.i ]
  %.27.i46.i = icmp slt i64 %e2.2.21477, 0
  br i1 %.20.i45.i, label %B16.i64.i, label %B148.i47.i

B16.i64.i:
  br i1 %.27.i46.i, label %B28.i65.i, label %span.2.exit

B28.i65.i:
  %.30.i66.i = sub i64 0, %e2.2.21477
  %.34.i67.i = sitofp i64 %.30.i66.i to double
  %.39.i69.i = fdiv double %.34.i67.i, %.35.i68.i
  %.49.le.i70.i = tail call double @llvm.ceil.f64(double %.39.i69.i)
  %.54.i71.i = fptosi double %.49.le.i70.i to i64
  %.56.i72.i = add nsw i64 %.11.i1413, %.54.i71.i
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
  %.156.i55.i = uitofp i64 %e2.2.21477 to double
  %.161.i57.i = fdiv double %.156.i55.i, %.157.i56.i
  %.171.le.i58.i = tail call double @llvm.floor.f64(double %.161.i57.i)
  %.176.i59.i = fptosi double %.171.le.i58.i to i64
  %.178.i60.i = add nsw i64 %.11.i1413, %.176.i59.i
  %.11.i55.i61.i = tail call i64 @llvm.smin.i64(i64 %.178.i60.i, i64 %last.3.0.i21.i)
  br label %span.2.exit

span.2.exit:
  %first.2.0.i50.i = phi i64 [ %first.2.0.i20.i, %B172.i48.i ], [ %first.2.0.i20.i, %B160.i62.i ], [ %first.2.0.i20.i, %B184.i53.i ], [ %.11.i.i73.i, %B28.i65.i ], [ %first.2.0.i20.i, %B16.i64.i ]
  %last.3.0.i51.i = phi i64 [ %last.3.0.i21.i, %B172.i48.i ], [ %.131.i63.i, %B160.i62.i ], [ %.11.i55.i61.i, %B184.i53.i ], [ %last.3.0.i21.i, %B28.i65.i ], [ %last.3.0.i21.i, %B16.i64.i ]
  %reass.sub1491 = sub i64 %last.3.0.i51.i, %first.2.0.i50.i
  %.29921465.not = icmp ugt i64 %reass.sub1491, 9223372036854775806
  br i1 %.29921465.not, label %B3008, label %B2562.if.lr.ph

B2562.if.lr.ph:
  %.2949 = add nuw nsw i64 %reass.sub1491, 1
  %5 = getelementptr float, ptr %arg.depth.4, i64 %.2483
  %6 = getelementptr i32, ptr %arg.ids.4, i64 %.2488
  br label %B2562.if

B2888:
  %.3158 = load i32, ptr %.3157, align 4
  br label %B2890

B2890:
  %"$phi2890.3.2.5.off0" = phi i32 [ %.3158, %B2888 ], [ %extract.t, %B2562.if ]
  store i32 %"$phi2890.3.2.5.off0", ptr %.3157, align 4
  %.3239 = and i1 %.224, %.3181
  %.3095..3128 = select i1 %.3239, float %.3095, float %.3128
  store float %.3095..3128, ptr %.3127, align 4
  %.2992 = icmp ugt i64 %.2939.01467, 1
  br i1 %.2992, label %B2562.if, label %B3008

B3008:
  %.3309 = add nsw i64 %e0.2.21481, %.3307
  %.3315 = add nsw i64 %e1.2.21479, %.3313
  %.3319 = sub nsw i64 %e2.2.21477, %.3317
  %.2435 = icmp sgt i64 %.2381.01476, 1
  br i1 %.2435, label %B1904.if, label %B686.loopexit

B3070:
  br i1 %.3373.not, label %B3188, label %B3082

B3070.thread:
  br i1 %.3373.not, label %B3188, label %B56.i

B3082:
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
  br i1 %.1018, label %visible.2.exit, label %B116.if.lr.ph.i

B116.if.lr.ph.i:
  %9 = getelementptr i32, ptr %arg.lists.4, i64 %.1161
  br label %B116.if.i

B150.i:
  %.508.i = getelementptr i32, ptr %arg.slots.4, i64 %.460.i
  %.509.i = load i32, ptr %.508.i, align 4, !alias.scope !4, !noalias !22
  %.515.i = icmp slt i32 %.509.i, 0
  br i1 %.515.i, label %B178.i, label %B348.i

B178.i:
  %.551.i = trunc i64 %number.2.0307.i to i32
  store i32 %.551.i, ptr %.508.i, align 4, !alias.scope !4, !noalias !22
  %.554.i = add nsw i64 %number.2.0307.i, 1
  %.590.i = getelementptr i32, ptr %9, i64 %.460.i
  %.591.i = load i32, ptr %.590.i, align 4, !alias.scope !6, !noalias !24
  %.592.i = sext i32 %.591.i to i64
  tail call void @llvm.experimental.noalias.scope.decl(metadata !25)
  tail call void @llvm.experimental.noalias.scope.decl(metadata !28)
  tail call void @llvm.experimental.noalias.scope.decl(metadata !30)
  tail call void @llvm.experimental.noalias.scope.decl(metadata !32)
  tail call void @llvm.experimental.noalias.scope.decl(metadata !34)
  tail call void @llvm.experimental.noalias.scope.decl(metadata !36)
  tail call void @llvm.experimental.noalias.scope.decl(metadata !38)
  %.130.i.i = mul i64 %arg.triangles.5.1, %.592.i
  %.134.i.i = getelementptr i32, ptr %arg.triangles.4, i64 %.130.i.i
  %.135.i.i = load i32, ptr %.134.i.i, align 4, !alias.scope !40, !noalias !41
  %.136.i.i = sext i32 %.135.i.i to i64
  %.185.i.i = getelementptr i8, ptr %.134.i.i, i64 4
  %.186.i.i = load i32, ptr %.185.i.i, align 4, !alias.scope !40, !noalias !41
  %.187.i.i = sext i32 %.186.i.i to i64
  %.236.i.i = getelementptr i8, ptr %.134.i.i, i64 8
  %.237.i.i = load i32, ptr %.236.i.i, align 4, !alias.scope !40, !noalias !41
  %.238.i.i = sext i32 %.237.i.i to i64
  %.274.i.i = getelementptr i32, ptr %arg.wx.4, i64 %.136.i.i
  %.275.i.i = load i32, ptr %.274.i.i, align 4, !alias.scope !43, !noalias !44
  %.301.i.i = getelementptr i32, ptr %arg.wy.4, i64 %.136.i.i
  %.302.i.i = load i32, ptr %.301.i.i, align 4, !alias.scope !45, !noalias !46
  %.328.i.i = getelementptr i32, ptr %arg.wx.4, i64 %.187.i.i
  %.329.i.i = load i32, ptr %.328.i.i, align 4, !alias.scope !43, !noalias !44
  %.355.i.i = getelementptr i32, ptr %arg.wy.4, i64 %.187.i.i
  %.356.i.i = load i32, ptr %.355.i.i, align 4, !alias.scope !45, !noalias !46
  %.382.i.i = getelementptr i32, ptr %arg.wx.4, i64 %.238.i.i
  %.383.i.i = load i32, ptr %.382.i.i, align 4, !alias.scope !43, !noalias !44
  %.409.i.i = getelementptr i32, ptr %arg.wy.4, i64 %.238.i.i
  %.410.i.i = load i32, ptr %.409.i.i, align 4, !alias.scope !45, !noalias !46
  %.10.i.i.i = sext i32 %.275.i.i to i64
  %.11.i.i.i1406 = sext i32 %.302.i.i to i64
  %.12.i.i.i = sext i32 %.329.i.i to i64
  %.13.i.i.i = sub nsw i64 %.12.i.i.i, %.10.i.i.i
  %.14.i.i.i = sext i32 %.356.i.i to i64
  %.15.i.i.i = sub nsw i64 %.14.i.i.i, %.11.i.i.i1406
  %.16.i.i.i = sext i32 %.383.i.i to i64
  %.17.i.i.i = sub nsw i64 %.16.i.i.i, %.10.i.i.i
  %.18.i.i.i = sext i32 %.410.i.i to i64
  %.19.i.i.i = sub nsw i64 %.18.i.i.i, %.11.i.i.i1406
  %.457.i.i = mul nsw i64 %.19.i.i.i, %.13.i.i.i
  %.460.i.i = mul nsw i64 %.17.i.i.i, %.15.i.i.i
  %.461.i.i = sub nsw i64 %.457.i.i, %.460.i.i
  %.462.i.i = sitofp i64 %.461.i.i to double
  %.466.i.i = sitofp i32 %.275.i.i to double
  %.470.i.i = fmul double %.466.i.i, 3.906250e-03
  %.471.i.i = fsub double 5.000000e-01, %.470.i.i
  %.477.i.i = mul nsw i64 %number.2.0307.i, %.476.i.i
  %.478.i.i = sitofp i32 %.302.i.i to double
  %.482.i.i = fmul double %.478.i.i, 3.906250e-03
  %.483.i.i = fsub double 5.000000e-01, %.482.i.i
  %.510.i.i = getelementptr double, ptr %arg.table.4, i64 %.477.i.i
  store double %.483.i.i, ptr %.510.i.i, align 8, !alias.scope !47, !noalias !48
  %.560.i.i = getelementptr i8, ptr %.134.i.i, i64 12
  %.561.i.i = load i32, ptr %.560.i.i, align 4, !alias.scope !40, !noalias !41
  %.588.i.i = getelementptr i8, ptr %.510.i.i, i64 8
  %.589.i.i = sitofp i32 %.561.i.i to double
  store double %.589.i.i, ptr %.588.i.i, align 8, !alias.scope !47, !noalias !48
  %.621.i.i = getelementptr double, ptr %arg.wz.4, i64 %.136.i.i
  %.622.i.i = load double, ptr %.621.i.i, align 8, !alias.scope !49, !noalias !50
  %.648.i.i = getelementptr double, ptr %arg.wz.4, i64 %.187.i.i
  %.649.i.i = load double, ptr %.648.i.i, align 8, !alias.scope !49, !noalias !50
  %.675.i.i = getelementptr double, ptr %arg.wz.4, i64 %.238.i.i
  %.676.i.i = load double, ptr %.675.i.i, align 8, !alias.scope !49, !noalias !50
  %.681.i.i = fdiv double 2.560000e+02, %.462.i.i
  %.12.i.i.i.i = fsub double %.649.i.i, %.622.i.i
  %.13.i.i.i.i = sitofp i64 %.19.i.i.i to double
  %.14.i.i.i.i = fmul double %.12.i.i.i.i, %.13.i.i.i.i
  %.15.i.i.i.i = fsub double %.676.i.i, %.622.i.i
  %.16.i.i.i.i = sitofp i64 %.15.i.i.i to double
  %.17.i.i.i.i = fmul double %.15.i.i.i.i, %.16.i.i.i.i
  %.18.i.i.i.i = fsub double %.14.i.i.i.i, %.17.i.i.i.i
  %.19.i.i.i.i = fmul double %.681.i.i, %.18.i.i.i.i
  %.21.i.i.i.i = sitofp i64 %.13.i.i.i to double
  %.22.i.i.i.i = fmul double %.15.i.i.i.i, %.21.i.i.i.i
  %.24.i.i.i.i = sitofp i64 %.17.i.i.i to double
  %.25.i.i.i.i = fmul double %.12.i.i.i.i, %.24.i.i.i.i
  %.26.i.i.i.i = fsub double %.22.i.i.i.i, %.25.i.i.i.i
  %.27.i.i.i.i = fmul double %.681.i.i, %.26.i.i.i.i
  br i1 %or.cond.i, label %B80.i.i.i, label %depth_plane.2.exit.i.i

B80.i.i.i:
  %.79.i.i.i = tail call double @llvm.fabs.f64(double %.622.i.i)
  %.83.i.i.i = tail call double @llvm.fabs.f64(double %.649.i.i)
  %.87.i.i.i = tail call double @llvm.fabs.f64(double %.676.i.i)
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
  %.209.i.i.i = fadd double %.622.i.i, %.207.i.i.i
  br label %depth_plane.2.exit.i.i

for.body.i.i.i:
  %.134.le.i.i.i = tail call double @llvm.log2.f64(double %.16.i13.i.i.i)
  %.148.le.i.i.i = tail call double @llvm.floor.f64(double %.134.le.i.i.i)
  %.153.i.i.i = fadd double %.148.le.i.i.i, -2.300000e+01
  %exp2.i.i.i = tail call double @llvm.exp2.f64(double %.153.i.i.i)
  br label %B294.i.i.i

depth_plane.2.exit.i.i:
  %start.2.1.i.i.i = phi double [ %.209.i.i.i, %B294.i.i.i ], [ %.622.i.i, %B178.i ]
  %.715.i.i = fmul double %.471.i.i, %.19.i.i.i.i
  %.716.i.i = fadd double %.715.i.i, %start.2.1.i.i.i
  %.44.i.i.i = getelementptr i8, ptr %.510.i.i, i64 16
  store double %.716.i.i, ptr %.44.i.i.i, align 8, !alias.scope !51, !noalias !54
  %.71.i.i.i = getelementptr i8, ptr %.510.i.i, i64 24
  store double %.19.i.i.i.i, ptr %.71.i.i.i, align 8, !alias.scope !51, !noalias !54
  %.98.i.i.i = getelementptr i8, ptr %.510.i.i, i64 32
  store double %.27.i.i.i.i, ptr %.98.i.i.i, align 8, !alias.scope !51, !noalias !54
  br i1 %.745.i.i, label %B846.i.i, label %B348.i

B846.i.i:
  %.750.i.i = fmul double %.13.i.i.i.i, 2.560000e+02
  %.752.i.i = fmul double %.471.i.i, %.750.i.i
  %.753.i.i = fadd double %.752.i.i, 0.000000e+00
  %.761.i.i = fmul double %.24.i.i.i.i, -2.560000e+02
  %.44.i614.i.i = getelementptr i8, ptr %.510.i.i, i64 40
  store double %.753.i.i, ptr %.44.i614.i.i, align 8, !alias.scope !56, !noalias !59
  %.71.i615.i.i = getelementptr i8, ptr %.510.i.i, i64 48
  store double %.750.i.i, ptr %.71.i615.i.i, align 8, !alias.scope !56, !noalias !59
  %.98.i616.i.i = getelementptr i8, ptr %.510.i.i, i64 56
  store double %.761.i.i, ptr %.98.i616.i.i, align 8, !alias.scope !56, !noalias !59
  %.795.i.i = fmul double %.16.i.i.i.i, -2.560000e+02
  %.797.i.i = fmul double %.471.i.i, %.795.i.i
  %.800.i.i = fadd double %.797.i.i, 0.000000e+00
  %.808.i.i = fmul double %.21.i.i.i.i, 2.560000e+02
  %.44.i617.i.i = getelementptr i8, ptr %.510.i.i, i64 64
  store double %.800.i.i, ptr %.44.i617.i.i, align 8, !alias.scope !61, !noalias !64
  %.71.i618.i.i = getelementptr i8, ptr %.510.i.i, i64 72
  store double %.795.i.i, ptr %.71.i618.i.i, align 8, !alias.scope !61, !noalias !64
  %.98.i619.i.i = getelementptr i8, ptr %.510.i.i, i64 80
  store double %.808.i.i, ptr %.98.i619.i.i, align 8, !alias.scope !61, !noalias !64
  %.866.i.i = getelementptr double, ptr %arg.iw.4, i64 %.187.i.i
  %.867.i.i = load double, ptr %.866.i.i, align 8, !alias.scope !66, !noalias !67
  %.894.i.i = getelementptr double, ptr %arg.iw.4, i64 %.136.i.i
  %.895.i.i = load double, ptr %.894.i.i, align 8, !alias.scope !66, !noalias !67
  %.899.i.i = fdiv double %.867.i.i, %.895.i.i
  %.926.i.i = getelementptr double, ptr %arg.iw.4, i64 %.238.i.i
  %.927.i.i = load double, ptr %.926.i.i, align 8, !alias.scope !66, !noalias !67
  %.961.i.i = fdiv double %.927.i.i, %.895.i.i
  %.44.i620.i.i = getelementptr i8, ptr %.510.i.i, i64 88
  store double %.462.i.i, ptr %.44.i620.i.i, align 8, !alias.scope !68, !noalias !71
  %.71.i621.i.i = getelementptr i8, ptr %.510.i.i, i64 96
  store double %.899.i.i, ptr %.71.i621.i.i, align 8, !alias.scope !68, !noalias !71
  %.98.i622.i.i = getelementptr i8, ptr %.510.i.i, i64 104
  store double %.961.i.i, ptr %.98.i622.i.i, align 8, !alias.scope !68, !noalias !71
  br i1 %.1085624.not.i.i, label %B348.i, label %B1168.if.lr.ph.i.i

B1168.if.lr.ph.i.i:
  %.1165.i.i = mul i64 %arg.vary.5.1, %.136.i.i
  %10 = getelementptr float, ptr %arg.vary.4, i64 %.1165.i.i
  %.1215.i.i = mul i64 %arg.vary.5.1, %.187.i.i
  %11 = getelementptr float, ptr %arg.vary.4, i64 %.1215.i.i
  %.1264.i.i = mul i64 %arg.vary.5.1, %.238.i.i
  %12 = getelementptr float, ptr %arg.vary.4, i64 %.1264.i.i
  br label %B1168.if.i.i

B1168.if.i.i:
  %.1032.0626.i.i = phi i64 [ %arg.vary.5.1, %B1168.if.lr.ph.i.i ], [ %.1094.i.i, %B1168.if.i.i ]
  %.1029.0625.i.i = phi i64 [ 0, %B1168.if.lr.ph.i.i ], [ %.1098.i.i, %B1168.if.i.i ]
  %.1094.i.i = add nsw i64 %.1032.0626.i.i, -1
  %.1098.i.i = add nuw nsw i64 %.1029.0625.i.i, 1
  %.1169.i.i = getelementptr float, ptr %10, i64 %.1029.0625.i.i
  %.1170.i.i = load float, ptr %.1169.i.i, align 4, !alias.scope !73, !noalias !74
  %.1219.i.i = getelementptr float, ptr %11, i64 %.1029.0625.i.i
  %.1220.i.i = load float, ptr %.1219.i.i, align 4, !alias.scope !73, !noalias !74
  %.1221.i.i = fsub float %.1220.i.i, %.1170.i.i
  %.1268.i.i = getelementptr float, ptr %12, i64 %.1029.0625.i.i
  %.1269.i.i = load float, ptr %.1268.i.i, align 4, !alias.scope !73, !noalias !74
  %.1270.i.i = fsub float %.1269.i.i, %.1170.i.i
  %13 = mul i64 %.1029.0625.i.i, 24
  %14 = getelementptr i8, ptr %.44.i.i.i, i64 %13
  %.44.i623.i.i = getelementptr i8, ptr %14, i64 96
  %.45.i.i.i = fpext float %.1170.i.i to double
  store double %.45.i.i.i, ptr %.44.i623.i.i, align 8, !alias.scope !75, !noalias !78
  %.72.i.i.i = getelementptr i8, ptr %14, i64 104
  %.73.i.i.i = fpext float %.1221.i.i to double
  store double %.73.i.i.i, ptr %.72.i.i.i, align 8, !alias.scope !75, !noalias !78
  %.100.i.i.i = getelementptr i8, ptr %14, i64 112
  %.101.i.i.i = fpext float %.1270.i.i to double
  store double %.101.i.i.i, ptr %.100.i.i.i, align 8, !alias.scope !75, !noalias !78
  %.1085.i.i = icmp ugt i64 %.1032.0626.i.i, 1
  br i1 %.1085.i.i, label %B1168.if.i.i, label %B348.i

B348.i:
  %number.4.2.i = phi i64 [ %number.2.0307.i, %B150.i ], [ %.554.i, %depth_plane.2.exit.i.i ], [ %.554.i, %B846.i.i ], [ %.554.i, %B1168.if.i.i ]
  %slot.2.2.off0.i = phi i32 [ %.509.i, %B150.i ], [ %.551.i, %depth_plane.2.exit.i.i ], [ %.551.i, %B846.i.i ], [ %.551.i, %B1168.if.i.i ]
  store i32 %slot.2.2.off0.i, ptr %15, align 4, !alias.scope !1, !noalias !80
  br label %B361.i

B361.i:
  %number.3.1.i = phi i64 [ %number.4.2.i, %B348.i ], [ %number.2.0307.i, %B116.if.i ]
  %.384.i = icmp ugt i64 %.331.0306.i, 1
  br i1 %.384.i, label %B116.if.i, label %visible.2.exit

B116.if.i:
  %number.2.0307.i = phi i64 [ 0, %B116.if.lr.ph.i ], [ %number.3.1.i, %B361.i ]
  %.331.0306.i = phi i64 [ %arg.ids.5.0, %B116.if.lr.ph.i ], [ %.393.i, %B361.i ]
  %.328.0305.i = phi i64 [ 0, %B116.if.lr.ph.i ], [ %.397.i, %B361.i ]
  %.393.i = add nsw i64 %.331.0306.i, -1
  %.397.i = add nuw nsw i64 %.328.0305.i, 1
  %15 = getelementptr i32, ptr %arg.ids.4, i64 %.328.0305.i
  %.455.i = load i32, ptr %15, align 4, !alias.scope !1, !noalias !80
  %.460.i = sext i32 %.455.i to i64
  %.461.i = icmp slt i32 %.455.i, 0
  br i1 %.461.i, label %B361.i, label %B150.i

visible.2.exit:
  %.3445 = sub nsw i64 %.11.i1408, %quot.1.0
  tail call void %.3472(ptr %arg.context.4, ptr %arg.ids.4, ptr %arg.table.4, i64 %rem.01449, i64 %quot.1.0, i64 %.3445)
  br label %B3188

B3188:
  %.236 = atomicrmw add ptr %arg.counter.4, i64 1 monotonic, align 8
  %.242.not = icmp slt i64 %.236, %arg.count
  br i1 %.242.not, label %B148, label %B144

B148.else.if:
  %16 = or i64 %.336, %arg.tiles_x
  %17 = icmp ult i64 %16, 4294967296
  br i1 %17, label %18, label %22

18:
  %19 = trunc i64 %.336 to i32
  %20 = urem i32 %19, %0
  %21 = zext i32 %20 to i64
  br label %B148.endif.else.if

22:
  %23 = srem i64 %.336, %arg.tiles_x
  br label %B148.endif.else.if

B148.endif.endif:
  %rem.01449 = phi i64 [ 0, %B148 ], [ %25, %37 ]
  %quot.1.0 = phi i64 [ 0, %B148 ], [ %40, %37 ]
  %.435 = add nsw i64 %rem.01449, 64
  %.11.i1407 = tail call i64 @llvm.smin.i64(i64 %.435, i64 %arg.width)
  %.468 = add nsw i64 %quot.1.0, 64
  %.11.i1408 = tail call i64 @llvm.smin.i64(i64 %.468, i64 %arg.height)
  %.515 = shl nsw i64 %quot.1.0, 6
  %.517 = add nsw i64 %.515, %rem.01449
  %"$phi406.0.2.sroa.8.1" = select i1 %.505.not, i64 %.517, i64 0
  br i1 %.540, label %B426, label %B602.else.endif

B148.endif.else.if:
  %24 = phi i64 [ %21, %18 ], [ %23, %22 ]
  %.364 = xor i64 %24, %arg.tiles_x
  %.365 = icmp slt i64 %.364, 0
  %.366 = icmp ne i64 %24, 0
  %.367 = and i1 %.366, %.365
  %.374 = select i1 %.367, i64 %arg.tiles_x, i64 0
  %spec.select = add i64 %.374, %24
  %25 = shl nsw i64 %spec.select, 6
  %26 = or i64 %.336, %arg.tiles_x
  %27 = icmp ult i64 %26, 4294967296
  br i1 %27, label %28, label %34

28:
  %29 = trunc i64 %.336 to i32
  %30 = udiv i32 %29, %0
  %31 = urem i32 %29, %0
  %32 = zext i32 %30 to i64
  %33 = zext i32 %31 to i64
  br label %37

34:
  %35 = sdiv i64 %.336, %arg.tiles_x
  %36 = srem i64 %.336, %arg.tiles_x
  br label %37

37:
  %38 = phi i64 [ %32, %28 ], [ %35, %34 ]
  %39 = phi i64 [ %33, %28 ], [ %36, %34 ]
  %.407 = xor i64 %39, %arg.tiles_x
  %.408 = icmp slt i64 %.407, 0
  %.409 = icmp ne i64 %39, 0
  %.410 = and i1 %.409, %.408
  %.415 = sext i1 %.410 to i64
  %spec.select1403 = add i64 %38, %.415
  %40 = shl nsw i64 %spec.select1403, 6
  br label %B148.endif.endif

B458.if:
  %.567.01462 = phi i64 [ %quot.1.0, %B458.if.lr.ph ], [ %.636, %B458.loopexit ]
  %.570.01461 = phi i64 [ %.580, %B458.if.lr.ph ], [ %.632, %B458.loopexit ]
  %.632 = add nsw i64 %.570.01461, -1
  %.636 = add i64 %.567.01462, 1
  br i1 %.7451457.not, label %B458.loopexit, label %B494.if.lr.ph

B494.if.lr.ph:
  %41 = mul nsw i64 %.567.01462, %"$phi406.0.2.sroa.0.1"
  %.788 = sub i64 %41, %"$phi406.0.2.sroa.8.1"
  %42 = getelementptr float, ptr %arg.depth.4, i64 %.788
  br label %B494.if

B494.if:
  %.689.01459 = phi i64 [ %rem.01449, %B494.if.lr.ph ], [ %.758, %B494.if ]
  %.692.01458 = phi i64 [ %spec.select1453, %B494.if.lr.ph ], [ %.754, %B494.if ]
  %.754 = add nsw i64 %.692.01458, -1
  %.758 = add i64 %.689.01459, 1
  %.816 = getelementptr float, ptr %42, i64 %.689.01459
  store float %.784, ptr %.816, align 4
  %.745 = icmp sgt i64 %.692.01458, 1
  br i1 %.745, label %B494.if, label %B458.loopexit

B602.else.endif:
  br i1 %.1018, label %.1084.if, label %.1084.endif.preheader, !prof !81

.1084.endif.preheader:
  tail call void @llvm.memset.p0.i64(ptr align 4 %arg.ids.4, i8 -1, i64 %1, i1 false)
  br label %.1084.if

.1084.if:
  %.1145 = icmp slt i64 %.336, 0
  %.1146 = select i1 %.1145, i64 %arg.offsets.5.0, i64 0
  %43 = getelementptr i64, ptr %arg.offsets.4, i64 %.336
  %.1160 = getelementptr i64, ptr %43, i64 %.1146
  %.1161 = load i64, ptr %.1160, align 8
  %.1179 = icmp slt i64 %.336, -1
  %.1180 = select i1 %.1179, i64 %arg.offsets.5.0, i64 0
  %44 = getelementptr i8, ptr %43, i64 8
  %.1194 = getelementptr i64, ptr %44, i64 %.1180
  %.1195 = load i64, ptr %.1194, align 8
  %.1240 = sub i64 %.1195, %.1161
  %.1241 = icmp sgt i64 %.1240, 0
  br i1 %.1241, label %B688.if.lr.ph, label %B3070.thread

B688.if.lr.ph:
  %.2130 = add nsw i64 %.11.i1407, -1
  %.2212 = add nsw i64 %.11.i1408, -1
  br label %B688.if

B688.if:
  %.1227.01485 = phi i64 [ %.1161, %B688.if.lr.ph ], [ %.1297, %B686.loopexit ]
  %.1230.01484 = phi i64 [ %.1240, %B688.if.lr.ph ], [ %.1293, %B686.loopexit ]
  %.1293 = add nsw i64 %.1230.01484, -1
  %.1297 = add i64 %.1227.01485, 1
  tail call void @llvm.experimental.noalias.scope.decl(metadata !82)
  tail call void @llvm.experimental.noalias.scope.decl(metadata !85)
  %.107.i = add nsw i64 %.1227.01485, 8
  %.108.i = icmp slt i64 %.107.i, %.1195
  br i1 %.108.i, label %B40.i, label %soon.2.exit

B40.i:
  %.138.i = getelementptr i32, ptr %arg.lists.4, i64 %.107.i
  %.139.i = load i32, ptr %.138.i, align 4, !alias.scope !82, !noalias !87
  %.140.i = sext i32 %.139.i to i64
  %.152.i = mul i64 %arg.triangles.6.0, %.140.i
  %.153.i = add i64 %.152.i, %.151.i
  %.154.i = inttoptr i64 %.153.i to ptr
  tail call void @llvm.prefetch.p0(ptr %.154.i, i32 0, i32 3, i32 1), !noalias !92
  %45 = getelementptr i32, ptr %arg.lists.4, i64 %.1227.01485
  %.185.i = getelementptr i8, ptr %45, i64 16
  %.186.i = load i32, ptr %.185.i, align 4, !alias.scope !82, !noalias !87
  %.189.i = sext i32 %.186.i to i64
  %.351.i = mul i64 %arg.triangles.5.1, %.189.i
  %46 = getelementptr i32, ptr %arg.triangles.4, i64 %.351.i
  br label %B312.if.i

B312.if.i:
  %.219.0276.i = phi i64 [ 3, %B40.i ], [ %.283.i, %B312.if.i ]
  %.216.0275.i = phi i64 [ 0, %B40.i ], [ %.287.i, %B312.if.i ]
  %.283.i = add nsw i64 %.219.0276.i, -1
  %.287.i = add nuw nsw i64 %.216.0275.i, 1
  %.355.i = getelementptr i32, ptr %46, i64 %.216.0275.i
  %.356.i = load i32, ptr %.355.i, align 4, !alias.scope !85, !noalias !92
  %.357.i = sext i32 %.356.i to i64
  %.373.i = mul i64 %arg.wx.6.0, %.357.i
  %.374.i = add i64 %.373.i, %.372.i
  %.375.i = inttoptr i64 %.374.i to ptr
  tail call void @llvm.prefetch.p0(ptr %.375.i, i32 0, i32 3, i32 1), !noalias !93
  %.389.i = mul i64 %arg.wy.6.0, %.357.i
  %.390.i = add i64 %.389.i, %.388.i
  %.391.i = inttoptr i64 %.390.i to ptr
  tail call void @llvm.prefetch.p0(ptr %.391.i, i32 0, i32 3, i32 1), !noalias !93
  %.405.i = mul i64 %arg.wz.6.0, %.357.i
  %.406.i = add i64 %.405.i, %.404.i
  %.407.i = inttoptr i64 %.406.i to ptr
  tail call void @llvm.prefetch.p0(ptr %.407.i, i32 0, i32 3, i32 1), !noalias !93
  %.274.i = icmp ugt i64 %.219.0276.i, 1
  br i1 %.274.i, label %B312.if.i, label %soon.2.exit

soon.2.exit:
  %.1404 = getelementptr i32, ptr %arg.lists.4, i64 %.1227.01485
  %.1405 = load i32, ptr %.1404, align 4
  %.1406 = sext i32 %.1405 to i64
  %.1452 = mul i64 %arg.triangles.5.1, %.1406
  %.1456 = getelementptr i32, ptr %arg.triangles.4, i64 %.1452
  %.1457 = load i32, ptr %.1456, align 4
  %.1458 = sext i32 %.1457 to i64
  %.1508 = getelementptr i8, ptr %.1456, i64 4
  %.1509 = load i32, ptr %.1508, align 4
  %.1510 = sext i32 %.1509 to i64
  %.1560 = getelementptr i8, ptr %.1456, i64 8
  %.1561 = load i32, ptr %.1560, align 4
  %.1562 = sext i32 %.1561 to i64
  %.1589 = getelementptr i32, ptr %arg.wx.4, i64 %.1458
  %.1590 = load i32, ptr %.1589, align 4
  %.1616 = getelementptr i32, ptr %arg.wy.4, i64 %.1458
  %.1617 = load i32, ptr %.1616, align 4
  %.1643 = getelementptr i32, ptr %arg.wx.4, i64 %.1510
  %.1644 = load i32, ptr %.1643, align 4
  %.1670 = getelementptr i32, ptr %arg.wy.4, i64 %.1510
  %.1671 = load i32, ptr %.1670, align 4
  %.1697 = getelementptr i32, ptr %arg.wx.4, i64 %.1562
  %.1698 = load i32, ptr %.1697, align 4
  %.1724 = getelementptr i32, ptr %arg.wy.4, i64 %.1562
  %.1725 = load i32, ptr %.1724, align 4
  %.10.i1409 = sext i32 %.1590 to i64
  %.11.i1410 = sext i32 %.1617 to i64
  %.12.i = sext i32 %.1644 to i64
  %.13.i = sub nsw i64 %.12.i, %.10.i1409
  %.14.i = sext i32 %.1671 to i64
  %.15.i = sub nsw i64 %.14.i, %.11.i1410
  %.16.i = sext i32 %.1698 to i64
  %.17.i = sub nsw i64 %.16.i, %.10.i1409
  %.18.i = sext i32 %.1725 to i64
  %.19.i = sub nsw i64 %.18.i, %.11.i1410
  %.1763 = mul nsw i64 %.19.i, %.13.i
  %.1765 = mul nsw i64 %.17.i, %.15.i
  %.1766 = sub nsw i64 %.1763, %.1765
  %.1767 = sitofp i64 %.1766 to double
  %.1771 = fdiv double 2.560000e+02, %.1767
  %.1798 = getelementptr double, ptr %arg.wz.4, i64 %.1458
  %.1799 = load double, ptr %.1798, align 8
  %.1825 = getelementptr double, ptr %arg.wz.4, i64 %.1510
  %.1826 = load double, ptr %.1825, align 8
  %.1852 = getelementptr double, ptr %arg.wz.4, i64 %.1562
  %.1853 = load double, ptr %.1852, align 8
  %.12.i.i = fsub double %.1826, %.1799
  %.13.i.i = sitofp i64 %.19.i to double
  %.14.i.i = fmul double %.12.i.i, %.13.i.i
  %.15.i.i = fsub double %.1853, %.1799
  %.16.i.i = sitofp i64 %.15.i to double
  %.17.i.i = fmul double %.15.i.i, %.16.i.i
  %.18.i.i = fsub double %.14.i.i, %.17.i.i
  %.19.i.i = fmul double %.1771, %.18.i.i
  %.21.i.i = sitofp i64 %.13.i to double
  %.22.i.i = fmul double %.15.i.i, %.21.i.i
  %.24.i.i = sitofp i64 %.17.i to double
  %.25.i.i = fmul double %.12.i.i, %.24.i.i
  %.26.i.i = fsub double %.22.i.i, %.25.i.i
  %.27.i.i1411 = fmul double %.1771, %.26.i.i
  br i1 %or.cond.i, label %B80.i, label %depth_plane.2.exit

B80.i:
  %.79.i = tail call double @llvm.fabs.f64(double %.1799)
  %.83.i = tail call double @llvm.fabs.f64(double %.1826)
  %.87.i = tail call double @llvm.fabs.f64(double %.1853)
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
  %.209.i = fadd double %.1799, %.207.i
  br label %depth_plane.2.exit

for.body.i:
  %.134.le.i = tail call double @llvm.log2.f64(double %.16.i13.i)
  %.148.le.i = tail call double @llvm.floor.f64(double %.134.le.i)
  %.153.i1412 = fadd double %.148.le.i, -2.300000e+01
  %exp2.i = tail call double @llvm.exp2.f64(double %.153.i1412)
  br label %B294.i

depth_plane.2.exit:
  %start.2.1.i = phi double [ %.209.i, %B294.i ], [ %.1799, %soon.2.exit ]
  %.1891 = sitofp i32 %.1617 to double
  %.1895 = fmul double %.1891, 3.906250e-03
  %.1896 = fsub double 5.000000e-01, %.1895
  %.1900 = sitofp i32 %.1590 to double
  %.1904 = fmul double %.1900, 3.906250e-03
  %.1905 = fsub double 5.000000e-01, %.1904
  %.1907 = fmul double %.1905, %.19.i.i
  %.1908 = fadd double %.1907, %start.2.1.i
  %.1961 = getelementptr i8, ptr %.1456, i64 16
  %.1962 = load i32, ptr %.1961, align 4
  %.1963 = sext i32 %.1962 to i64
  %.11.i1413 = tail call i64 @llvm.smax.i64(i64 %rem.01449, i64 %.1963)
  %.2042 = getelementptr i8, ptr %.1456, i64 20
  %.2043 = load i32, ptr %.2042, align 4
  %.2044 = sext i32 %.2043 to i64
  %.11.i1414 = tail call i64 @llvm.smax.i64(i64 %quot.1.0, i64 %.2044)
  %.2126 = getelementptr i8, ptr %.1456, i64 24
  %.2127 = load i32, ptr %.2126, align 4
  %.2128 = sext i32 %.2127 to i64
  %.11.i1415 = tail call i64 @llvm.smin.i64(i64 %.2130, i64 %.2128)
  %.2208 = getelementptr i8, ptr %.1456, i64 28
  %.2209 = load i32, ptr %.2208, align 4
  %.2210 = sext i32 %.2209 to i64
  %.11.i1416 = tail call i64 @llvm.smin.i64(i64 %.2212, i64 %.2210)
  %.neg = mul nsw i64 %.15.i, -256
  %.2341.neg = sub nsw i64 %.15.i, %.19.i
  %.2343 = shl nsw i64 %.2341.neg, 8
  %.2344 = shl nsw i64 %.19.i, 8
  %reass.sub1490 = sub i64 %.11.i1416, %.11.i1414
  %.24351474.not = icmp ugt i64 %reass.sub1490, 9223372036854775806
  br i1 %.24351474.not, label %B686.loopexit, label %B1904.if.lr.ph

B1904.if.lr.ph:
  %.2391 = add nuw nsw i64 %reass.sub1490, 1
  %invariant.op = add nsw i64 %.11.i1415, 1
  %.2245 = shl nsw i64 %.11.i1413, 8
  %reass.sub = sub i64 %.2245, %.10.i1409
  %.2247 = add i64 %reass.sub, 128
  %.21.neg.neg.i = sub i64 %.2247, %.17.i
  %.23.neg.i1436 = mul i64 %.21.neg.neg.i, %.19.i
  %.26.i1429 = icmp slt i64 %.19.i, 1
  %.32.i1430 = icmp ne i32 %.1725, %.1617
  %.37.i1431 = icmp sgt i64 %.17.i, -1
  %or.cond.not.i1432 = select i1 %.32.i1430, i1 true, i1 %.37.i1431
  %narrow.i1433 = select i1 %.26.i1429, i1 %or.cond.not.i1432, i1 false
  %"$phi98.1.2.0.neg.i1434" = sext i1 %narrow.i1433 to i64
  %.24.i1437 = add i64 %.23.neg.i1436, %"$phi98.1.2.0.neg.i1434"
  %.2248 = shl nsw i64 %.11.i1414, 8
  %reass.sub1489 = sub i64 %.2248, %.11.i1410
  %.2250 = add i64 %reass.sub1489, 128
  %.18.neg.i = sub i64 %.19.i, %.2250
  %.20.i1435 = mul i64 %.18.neg.i, %.17.i
  %.56.i1438 = add i64 %.24.i1437, %.20.i1435
  %.21.neg.i = sub i64 %.13.i, %.2247
  %.11.i1418 = sub nsw i64 %.19.i, %.15.i
  %.23.neg.i = mul i64 %.21.neg.i, %.11.i1418
  %.26.i1419 = icmp sgt i64 %.11.i1418, -1
  %.32.i1420 = icmp ne i32 %.1725, %.1671
  %.10.i1417 = sub nsw i64 %.17.i, %.13.i
  %.37.i1421 = icmp slt i64 %.10.i1417, 1
  %or.cond.not.i1422 = select i1 %.32.i1420, i1 true, i1 %.37.i1421
  %narrow.i1423 = select i1 %.26.i1419, i1 %or.cond.not.i1422, i1 false
  %"$phi98.1.2.0.neg.i1424" = sext i1 %narrow.i1423 to i64
  %.24.i1427 = add i64 %.23.neg.i, %"$phi98.1.2.0.neg.i1424"
  %.18.i1425 = sub nsw i64 %.2250, %.15.i
  %.20.i1426 = mul nsw i64 %.18.i1425, %.10.i1417
  %.56.i1428 = add i64 %.24.i1427, %.20.i1426
  %.26.i = icmp sgt i64 %.15.i, -1
  %.32.i = icmp ne i32 %.1671, %.1617
  %.37.i = icmp slt i64 %.13.i, 1
  %or.cond.not.i = select i1 %.32.i, i1 true, i1 %.37.i
  %narrow.i = select i1 %.26.i, i1 %or.cond.not.i, i1 false
  %"$phi98.1.2.0.neg.i" = sext i1 %narrow.i to i64
  %.23.i = mul nsw i64 %.2247, %.15.i
  %.24.i = sub i64 %"$phi98.1.2.0.neg.i", %.23.i
  %.20.i = mul nsw i64 %.2250, %.13.i
  %.56.i = add i64 %.24.i, %.20.i
  %.2500 = sub nsw i64 %.11.i1415, %.11.i1413
  %.2501 = icmp slt i64 %.2500, 8
  %.20.i.i = icmp slt i64 %.15.i, 0
  %.144.i.i.not = icmp eq i32 %.1671, %.1617
  %.152.i.i = sub nsw i64 0, %.neg
  %.157.i.i = sitofp i64 %.152.i.i to double
  %.131.i.i = add nsw i64 %.11.i1413, -1
  %.35.i.i = uitofp i64 %.neg to double
  %.20.i15.i = icmp sgt i64 %.2341.neg, 0
  %.144.i19.i = icmp slt i64 %.2341.neg, 0
  %.152.i24.i = sub nsw i64 0, %.2343
  %.157.i26.i = sitofp i64 %.152.i24.i to double
  %.35.i38.i = uitofp i64 %.2343 to double
  %.20.i45.i = icmp sgt i64 %.19.i, 0
  %.144.i49.i = icmp slt i64 %.19.i, 0
  %.152.i54.i = sub nsw i64 0, %.2344
  %.157.i56.i = sitofp i64 %.152.i54.i to double
  %.35.i68.i = uitofp i64 %.2344 to double
  %.3191 = sub nsw i64 %.1227.01485, %.1161
  %extract.t = trunc i64 %.3191 to i32
  %.2554.reass = sub i64 %invariant.op, %.11.i1413
  %spec.select1451 = tail call i64 @llvm.smax.i64(i64 %.2554.reass, i64 0)
  %.25971468.not = icmp slt i64 %.2554.reass, 1
  %.3307 = shl nsw i64 %.13.i, 8
  %.3313 = shl nsw i64 %.10.i1417, 8
  %.3317 = shl nsw i64 %.17.i, 8
  br label %B1904.if

B1904.if:
  %e0.2.21481 = phi i64 [ %.56.i, %B1904.if.lr.ph ], [ %.3309, %B3008 ]
  %e1.2.21479 = phi i64 [ %.56.i1428, %B1904.if.lr.ph ], [ %.3315, %B3008 ]
  %e2.2.21477 = phi i64 [ %.56.i1438, %B1904.if.lr.ph ], [ %.3319, %B3008 ]
  %.2381.01476 = phi i64 [ %.2391, %B1904.if.lr.ph ], [ %.2444, %B3008 ]
  %.2378.01475 = phi i64 [ %.11.i1414, %B1904.if.lr.ph ], [ %.2448, %B3008 ]
  %.2444 = add nsw i64 %.2381.01476, -1
  %.2448 = add i64 %.2378.01475, 1
  %.2474 = sitofp i64 %.2378.01475 to double
  %.2475 = fadd double %.1896, %.2474
  %.2477 = fmul double %.27.i.i1411, %.2475
  %.2479 = fadd double %.1908, %.2477
  %.2481 = mul nsw i64 %.2378.01475, %"$phi406.0.2.sroa.0.1"
  %.2483 = sub nsw i64 %.2481, %"$phi406.0.2.sroa.8.1"
  %.2485 = sub nsw i64 %.2378.01475, %quot.1.0
  %.2486 = shl nsw i64 %.2485, 6
  %.2488 = sub nsw i64 %.2486, %rem.01449
  br i1 %.2501, label %B2006, label %B2474

B2056.if:
  %i0.2.31473 = phi i64 [ %e0.2.21481, %B2056.if.lr.ph ], [ %.2846, %B2438 ]
  %i1.2.31472 = phi i64 [ %e1.2.21479, %B2056.if.lr.ph ], [ %.2849, %B2438 ]
  %i2.2.31471 = phi i64 [ %e2.2.21477, %B2056.if.lr.ph ], [ %.2852, %B2438 ]
  %.2544.01470 = phi i64 [ %spec.select1451, %B2056.if.lr.ph ], [ %.2606, %B2438 ]
  %.2541.01469 = phi i64 [ %.11.i1413, %B2056.if.lr.ph ], [ %.2610, %B2438 ]
  %.2606 = add nsw i64 %.2544.01470, -1
  %.2610 = add i64 %.2541.01469, 1
  %.2640 = or i64 %i1.2.31472, %i2.2.31471
  %.2642 = or i64 %.2640, %i0.2.31473
  %.2643 = icmp sgt i64 %.2642, -1
  br i1 %.2643, label %B2084, label %B2438

B2562.if:
  %.2939.01467 = phi i64 [ %.2949, %B2562.if.lr.ph ], [ %.3001, %B2890 ]
  %.2936.01466 = phi i64 [ %first.2.0.i50.i, %B2562.if.lr.ph ], [ %.3005, %B2890 ]
  %.3001 = add nsw i64 %.2939.01467, -1
  %.3005 = add i64 %.2936.01466, 1
  %.3034 = sitofp i64 %.2936.01466 to double
  %.3036 = fmul double %.19.i.i, %.3034
  %.3038 = fadd double %.2479, %.3036
  %.10.i1439 = fcmp olt double %.3038, 0.000000e+00
  %.11.i1440 = select i1 %.10.i1439, double 0.000000e+00, double %.3038
  %.10.i1441 = fcmp ogt double %.11.i1440, 1.000000e+00
  %.11.i1442 = select i1 %.10.i1441, double 1.000000e+00, double %.11.i1440
  %.3095 = fptrunc double %.11.i1442 to float
  %.3127 = getelementptr float, ptr %5, i64 %.2936.01466
  %.3128 = load float, ptr %.3127, align 4
  %.3157 = getelementptr i32, ptr %6, i64 %.2936.01466
  %.3167 = fcmp ogt float %.3128, %.3095
  %.3169 = and i1 %.210, %.3167
  %.3172 = fcmp oeq float %.3128, %.3095
  %.3174 = and i1 %.212, %.3172
  %.3175 = or i1 %.3169, %.3174
  %.3178 = fcmp olt float %.3128, %.3095
  %.3180 = and i1 %.214, %.3178
  %.3181 = or i1 %.3180, %.3175
  br i1 %.3181, label %B2890, label %B2888
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
!9 = distinct !{!9, !3, !"visible.2: %arg.triangles.4"}
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
!26 = distinct !{!26, !27, !"numbered.2: %arg.triangles.4"}
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
!86 = distinct !{!86, !84, !"soon.2: %arg.triangles.4"}
!87 = !{!88, !86, !89, !90, !91}
!88 = distinct !{!88, !84, !"soon.2: %retptr"}
!89 = distinct !{!89, !84, !"soon.2: %arg.window_x.4"}
!90 = distinct !{!90, !84, !"soon.2: %arg.window_y.4"}
!91 = distinct !{!91, !84, !"soon.2: %arg.depth.4"}
!92 = !{!88, !83, !89, !90, !91}
!93 = !{!88, !83}
