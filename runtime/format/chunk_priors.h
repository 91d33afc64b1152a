// SPDX-License-Identifier: MIT
// Made by tests/bench/train_chunks.cpp; how to read it: PriorReader in chunk_statistics.h.
#pragma once
namespace rill::format {
inline constexpr char chunk_priors[] = R"(
VT.14TT.6WU.6XUW.5XVX.5ZWYV.4ZXYV.4aYZWU.3cZZWU.3caaYVT.2dbbZWS.2fccaXT.2fddbYV.2geebZWT.ifgdbYV.F.7Q
.7GN.6PL.6RM.6TN.6VP.6XST.5YTV.5ZVWS.4aXXT.4bYZV.4bZaX.4dabX.20UQ.6YS.6USV.5YTWT.4ZUWT.4aWXT.4cXXUV.3
dZZWV.3eaaXWX.2fccYWX.2gedaXXW.iffcZXWUjggdbYWVljigcZXVolkhfcZWpnnkhecYXX.22aYb.5cZbZ.12dabZY.3ecdaZZ
.2fccaZX.2gdebZYW.heecaYW.iffdbYWVjggecZXUkhifcaXVljjgebYVollifdaYaSW.5bUWU.4dXXU.4cVXT.4dXYU.4dXYUQ.3
eYZVR.3eZaWS.3faaXSO.2fbbYUP.2gccZVP.2heeaXR.2iffcYTO.jggeaWQ.liifcZU.pkmhfcY.129aYaX.12WW.6bYaY.4cZa
YW.3bZaX.4dabYX.3dbcZXU.2eccaXU.2fcdaXVR.gddbYVQ.geecZVR.iffdaWSQihhebYUTjiifdaWUlih.5XRV.5aTWS.4YVWS
.4aUWT.4aWXTP.3bXXUN.3cYYUQ.3dZZVQ.3daaWSO.2ebbXTN.2fccYUO.2gddaVP.2hefbYSP.iggdbWR.ljigfZ.10X.255Tcf
cZXX.ZWX.5cYY.5aXZXX.3aZaYX.3eZZVT.3cbbXV.3ccbYWW.2eddZWU.2eeeaWU.2fgebXU.2gggdYVS.gjjeaXU.gjjfdaU.fk
jgf.11A.23A.7A.15B.7A.7B.7C.7D.7F.7H.7J.23dXI.381qsspidV.49c.7fgnpd.3cemld.3bfnikdU.bcgime.2ZegihhX.d
cfc.4fd.142nppoidT.81fkjj.4ae.6cehj.4bb.14dXSO.4bbaU.4cY.6cY.6eZZT.4ebaT.4fcaU.4gcbVK.3cXN.5dXM.309jh
hgdbXNjhigebXN.368TVY.5YUX.13ZWXT.4aWXT.4aWXU.4bXXT.4cYYU.4dZZW.4ebaY.4fc.46RR.6WS.14XTU.5ZUW.5ZVW.5a
VW.5aWX.5bX.62ZXY.5ZWY.13aWWV.4aWXU.4bWX.5bXXT.4cYYV.4dZaW.4ebbX.4kdc.45UWaZa.3TXaZaZ.2WYaZZZ.2YZbZZZ
X.babaZZXVeccaZZYVheecbaZWVS.6TSX.5UTV.5VVX.5XVY.5ZX.14XTV.5WTWV.4XUX.5XVXV.4ZWZY.4aYaY.4dbca.4ZUWU.4
XUWU.4YVXT.4ZWYV.4aXZW.4bYaYX.3ebcb.4bXYV.4aXYV.4bXYVT.3bYZWT.3cYaXU.3dZaZX.3fccbZX.2daaW.4daaXS.3daa
XT.3dabXU.3ebbYVT.2eccZXU.2gdebaX.2heebYV.2geebYW.2geebYW.2heebYVU.heecZWT.iffcaXU.jhhebZXUfegfdaYV.48
cVYV.52cXZZXV.50dXZXWV.50eZaXWV.50fbbZWVS.49iefcZXVT.48cbdbYVO.ZadbZWS.ccdbZWS.eeecZWS.gffdaXS.ihhebY
TSliigdaXTaUXU.4ZVXT.4bXYU.4cZZV.4daa.21cWYXU.3aXYVV.3cYZW.4daaXV.3fbcaV.3geec.12cXYWU.3bXYVS.3cZZWT.3
daaWU.3ecbZV.3fdebY.11dZZWUQ.2dZZWS.3eaaWT.3ebbXUQ.2fccZVR.2geeaX.3kgh.5fcbYUQ.2ebbXUP.2fccYUR.2fdcZV
Q.2gedaWS.2hfebXS.2ighebU.2geebWR.2geebWS.2heebXT.2hfebXS.2hffcYTP.iggdZUP.khhebXU.HdfcZXWT.48aWYU.52
cYZYX.51cYZXV.51fbaXVS.50hecZVS.50jggcYWT.49eYV.389psspjdU.K.23c.7qsrodT.2ceihidWR.280c.87rnfYL.3pfcU
.4gcZN.4cYWO.4dXSO.4eZXM.4gdaO.4pgcUN.3qohYM.59dXN.237acecdc.2dcfedd.2fefdcbZRhfgdcaYNiggecaYOjhhfcbX
NjhigebXN.328VVXUS.3bVXTQ.3bXWT.4bXXS.4bWZY.20YVWT.4bVWT.4bXV.5cXW.5aV.22aXY.5cXX.5eZW.5eaZ.29cZaY.4e
ZZW.4fb.38db.6fc.166Y.7ZZ.14X.7WY.30VVZX.4UWaYWU.2VXaYWTS.XVY.5YWZY.4ZXaZ.4YVY.5ZWZY.4aXaaY.3aWYX.4aX
ZYX.3bXaZZ.3bXYW.4cZaYW.3cZaZYW.2dZZWV.3eabYXU.2ebbZYWV.fbaXU.3gccZXVS.gddaYXV.hfebYX.2iggcaYXVjhgeca
YV.72da.22bZ.30lcdaX.3gabZWU.2dYbYWTS.kac.5gccaW.3cadc.4jb.6gbcaX.3cbdb.4hcca.4gccaYV.2dbcbY.3hddaY.3
gcdaYU.2ecebZW.2hedbYW.2gddbYV.2gdecZXT.jffcaXU.hffcZWU.hffcaXV.lihfcZVRliifdaXUkiifdbYW.56caaY.4bXYW
T.3ZTWT.4dcbZXU.2cZaXUN.2aWXVRQ.2eedaYU.2dbbYVP.2cZaWTR.2eedbYU.2eccZWQ.2daaXUR.2ffebZV.2fddaXS.2ebbY
VR.2ggecZVQ.geebYTP.eccZWSR.ghfcZW.2hffcZVR.gdebXTS.jiigcaU.khhecYTQiggdaXUS.320A.7A.7A.7Yoljc.3ZffbX
VT.YbbZXVVT.80dXS.5d.311ceihhcVSZae.501dXSO.4bbaU.4cY.6cY.6eZZT.4ebaT.4fcaU.4gcbVK.11dXN.61Zcec.4dced
.4fdedbbZ.hffdbaYOiggecaYOkhhfcaXOkhigebXN.8Zcecd.3ccfe.4feedbaY.hffdbaZPiggecaYPjhhfcaXOkijgebXM.200
Z.79aYZYX.3S.7ST.6OS.14Y.7Y.7X.7W.15aXZ.5YT.6XT.6WS.14bYYW.4ZV.6YT.6XSV.13bYYVQ.3aVW.5ZUVR.4YTVR.12dZ
YVS.3bXXU.4bXWT.4aWWS.4TTXU.4STXU.4VUXVS.3XWYVT.3ZYaXUS.2cacaXUT.ZT.6YT.6YU.6ZVX.5aXZX.4cabaYX.2aU.6a
U.6aU.6bWY.5bXZX.4dbcaYX.2ZV.6aV.6aW.6bXZ.5cYZY.4ebcaYXV.bX.6bXY.5cXY.5cYZX.4dZaYW.3fccaZXV.dZZ.5dZZ.5
dZZ.5eaZY.4ebbYW.3gddbZXV.ea.6ecbZ.4fbbZ.4fccYX.3gdcZX.3hfecZYWUjfge.4jfgdba.2iggdba.2ifgdaZY.jggdbZY
VkhhfcaYWbWaYXW.2dXZXUS.2eZaXUS.2fbbXVS.2gddZVS.2iffcZVS.dbdcaY.2eZbZ.4faa.5gccZW.3hddaX.3iffcaW.2ece
ca.3ebbY.4fbb.5gcdZ.4gddbX.3jffcaX.2fdfcaY.2ebca.4fcca.4gccZ.4heebX.3jfgdaXU.gdedbYW.fcda.4gdda.4hdda
Y.3heebY.3iggdaXV.jffdbZW.iedb.4hdeb.4heebZ.3igfcZU.2jhheaYU.jggdbZWTigg.5ih.6jggca.3khgdaW.2liifbYU.
mkjhebZWjf.6khh.5igifb.3jhhebY.2mkjhdaXUZTXV.4ZUWS.4aWWS.4cZYU.4dcbX.4fhda.4ZWZYW.3aWYVS.3bXYWS.3daZW
U.3ecbYUS.2heebXV.2aWZYXU.2aWYWT.3bXYVU.3daZWT.3ecbYUS.2heebXUS.bYaZXV.2bXZWT.3cYZWU.3daaWU.3fccYVS.2
heebXUT.cabZXU.2cZaXV.3daaXU.3dbaXUS.2fccYVT.2hefbYVT.eccaYV.2dabYW.3dbbYV.3ebbYWU.2fdcZWU.2hffbYVT.f
debYVO.eccaXV.2ecdaXW.2fcdaXV.2gddaXVS.hffcZWU.hffcZVO.geecaW.2geecaX.2gfecaWS.hffcaXS.iggeaYVSES.6bU
.6fY.30MXaY.4cXZW.4eaZW.4gcbW.4ifeaW.3khhdZ.3KXZYX.3cXYW.4eaZX.4gcbWV.3hfeaV.3jhheZW.2LZaZ.4cYZX.4faZ
W.4gdbXU.3jfeaV.3khhea.3LbcaY.3daaX.4fbaY.4hdbYV.3iffaV.3kiieaW.2KdebY.3ebbY.4fbbY.4hecYV.3kgfaW.3lii
faX.2MggcZY.2gcca.4idba.4iedZX.3khgbW.3ljjgbX.2RhgcZXW.heea.4iedZ.4jgeYW.3khgcX.3nllhcY.2dXQ.37cd.342
nmspjdU.T.15X.7ad.6cehggbVR.336dZXUK.3dXN.373jhhgdbXN.40gggfdaU.iggfcaV.iggecaX.jhhecaXOkhifdaXNkijhf
cYN.288U.47U.47SVZY.4YW.6hX.30XT.46XTY.5XV.38YUXU.4YU.6a.31ZVWU.4ZUV.5bXX.5cZ.22bXXTQ.3bWWT.4cYXV.4dZ
ZW.4fcdZ.15YYXXXWU.17YYYXWVU.17YXWVU.19YXWWV.43YaYWW.19XN.22ZZZYVK.18WU.27SQ.32eZ.7gcZ.6iebZ.5jgdba.4
jhecba.3ligecbb.2kkhfdccc.2KIIKN.11UTTTU.27acXaaYYaaZYWXWP.adXabYZYaaZZYZZ.adXabYZ.3aY.4bcX.13c.46ZZZ
ZaZZZZZZZZZZZZZZZZZZZZZYYYYYZZZZaaaaZXWXXYZbccccZ.26ZZZYXXZZYXU.ZZYWTQZYZYV.ZZZYW.ZZZYW.ZZZZZYaaZaa.a
aaab.aaaab.aaaac.aaaab.ZaaZZZYYZZZZXYYZZ.XXYYZ.XYYYX.XYZZXQYYZZZ.ZZZZZZaZaZZ.baaaa.aaaab.baaab.aaaaa.
aaaZZZYYZZZZYYYYVVYYZYXUYZZZYWZZZZZ.aaaaa.aaaaadaaaab.aZZZZZ.25WeYg.5k.2WZbb.5m.4fddefdedcYaaW.3jgkjk
ikjkiiieO.AA.R.3aO.6aZXF.12caZZaXF.25naZZaaZZZZXaF.52AA.J.3TH.6VWW.13YYYXYZ.26YZZZZZZZZZZb.52yz.cfdbb
.ehkif.eiknh.egjmm.efiln.efikn.dghjq.begip.begjq.Zcfhp.aehjtlbcgirjsrqlbcefheghhigkkjkhonoom.oqt.42im
ppqoqpplopadefghhfgfgkdgjklnmlljiqejnpopqoonntgnqrrrrqrqpwhpststutttsy.61jhhghhiiiig.bebcc.dgjff.ehjn
g.fhknn.egjln.dehjn.dfijo.cdgjq.dfiir.abffo.aefgrjbbegpfxvtrbcefieghhjhllllkoprqsmosw.42eilmnlmnojomZ
ceffghhhhelbgiknnoonnlrekotstsssrpvhoruututtsswmuvvvvvuuutx.Taabccddded.cefefffggge.gjjkjkklljj.lmonn
ononnm.rtttsssstsp.300n.k.69s.71s.83s.59sciYpekcjcgdldhflfihifhgffffggggfZddjccgfdddgeeehfgfhghffggfg
ggfhcdcjdjhgcgdjfjehgjdggheggggggggifiagfeiffeffgfgfggfgggfgggggggggggggggggggggggggggggggggggggggggg
ggggggggggggggggggggggggggggggcgcddjddfifefgfgggggggggggggggggcedccddecddedddececeeeceddddffefdhicdeg
cffffggggggggggggggggggggcaaccbZcfdbggdhPXacjgggggggg.hrq.jts.9o.18
)";
}  // namespace rill::format
