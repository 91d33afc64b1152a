// SPDX-License-Identifier: MIT
// Made by tests/bench/train_chunks.cpp; how to read it: PriorReader in chunk_statistics.h.
#pragma once
namespace rill::format {
inline constexpr char chunk_priors[] = R"(
WU.14UV.6XU.6XVa.5XVZ.5ZWYX.4aXZXY.3aYZXW.3bZaYW.3cabYXV.2dbcZXV.2dbcaYW.2ecdbZWS.fdecaYS.hfgecZ.2KI.6
S.7KK.6RL.6SM.6UP.6WQ.6XSW.5YUXP.4ZWYV.4aYaWO.3aZbYP.3bbcZU.3cb.22VT.6XU.6VUX.5XVXU.4XWYU.4YXYV.4ZZZW
W.3aabXW.3bbcYXX.2ccdaXX.2deebYYX.fffcZYW.hggebYXUjiifdaXVmkkhfcZWpnmkifcZXY.22ZZb.5baca.12dbca.4ecdb
Z.3fcdbZY.2gdebZYX.gefcaYW.hefdaYXVhfgebZXWighecaYVkhigdbZWmjkhfdbZZTX.5aUWV.4bXY.5bVXU.4cXYV.4cYYVS.3
cZZWR.3daaWS.3eabXT.3ebcYUS.2fcdZVR.2gdebXS.2gefcZU.2iggebXS.jihfdaW.mmnigc.130aZcZV.11W.7bZbZX.3babZ
X.3aab.5cacZW.3dbcZXT.2dccaXU.2dddaXU.2edebYUR.eefcYVS.fffdZWT.fghebYV.ejkfdbX.9XTYV.4ZUXR.4XWYV.4ZVX
U.4ZXYUS.3aYYUR.3bYZVR.3bZaWS.3cabXS.3cbcYTP.2dddZUQ.2deeaWS.2dgfcYV.2cikebY.274TbeaYY.2ZVX.5cYW.5aXY
W.4aZaYX.3eZYV.4dbbXV.3dcbYW.3edcZW.3eedaW.3ffebYT.2ggfdZV.2gihebY.2hijfb.19A.23A.7A.15A.7A.7A.7A.7B.7
F.7H.7H.23bK.382tqngdT.50dh.6Y.7a.7Y.7Za.6c.255W.31cXVI.4baZU.4a.7bW.6dZY.5eaZT.4fbaU.4fcbVJ.3dYS.5dY
S.309jhhfdaVLjhhfcaVL.368WXcQ.4WWbU.12XWaU.4XXaU.4YYZV.4YYaV.4ZZbW.4bbcV.60TYgO.4UT.14VVdR.4VV.6VV.6V
W.6WZ.6V.63YV.6YU.14ZVW.5aV.6aW.6aXY.5aYY.5bZ.62VWaaZY.2UXaZZX.2WYaZZ.3YZbaZY.2bacaZYY.ecdbaZXVhffdca
ZWVT.6UUX.5VV.6VV.6WW.6Y.15XUX.5WVX.5XVY.5XWY.5ZXZ.5bYb.5ed.6YVZ.5XVY.5YWY.5YWZV.4ZXaY.4bYb.5eb.6aXZV
.4ZXZW.4aYaW.4aYaX.4bZbYV.3cabZ.4ecdca.3babX.4babX.4babX.4cacYT.3cbcZV.3dcdaX.3geecZ.3eddbX.3edebY.3e
eebYV.2eefbYW.2fefcZWT.gffdaXU.ihhfcaXVedfecaYW.48aVXV.52cXZYW.51cXZXV.51dZaXVV.50ebcZWU.50gefcZXWV.48
aacaXTM.YacaYW.2abdbZW.2cdebZWT.dffcaWS.fhhebXU.gjjgdaXTZVXU.4YWYU.4ZXZ.5aZZ.5b.23bWYWS.3ZXYV.4aZZV.4
baaX.4cbb.5d.15bXYVS.3aYYV.4bZaW.4babXS.3cccZ.4d.15cZaWT.3baaWT.3cbaXT.3ccbYT.3cddZV.3cfec.12dccYUP.2
cccYT.3dccYU.3dddZU.3deeaW.3dggbY.11eeeaVP.2defbX.3dfebX.3dffbXT.2dggcYU.2dhidZV.2cljgcZ.2KcebZXW.49a
VX.53cYZX.52cYZWV.51fbaXU.51hdcYVR.50iggcZWU.49bS.390oomhcT.26ennb.4blskcV.2ZcggcV.370ojeX.4lfcU.4gbZ
N.4cYV.5cXVI.4dZW.5idaQ.4nhdV.4rlgY.60dYSI.236adffecR.ededd.3gefdcaW.iggebZU.iggebZUNjhhecZUNkiigdaVL
.328WXbS.4XWbS.4XXZT.4XXaS.4XXcX.20YUV.5aUW.5bW.6bW.30aV.6bW.46VY.6XY.46V.183Xa.22V.31UU.6UWaYV.3VXbY
WUT.XT.6XWa.5ZXaa.4YT.6ZWa.5aYba.4ZUX.5aXaY.4bYaZX.3aWXV.4bYaYV.3cZbZYX.2cYYW.4daaYW.3ebcaYW.2fbaX.4f
cbZWW.2gddbZXV.iffbZ.3iffcaYWSjggecaYW.72da.22c.31hbcZ.4eZbYVS.2cZaYWUU.fb.6ebcY.4aad.5fb.6ebdZ.4bbd.5
fbda.4ebdZV.3cbdb.4fddZX.3fcdaW.3dcdbYV.2gddaXT.2fddbXV.2fcecZX.2hefbYV.2heecZW.2heecaXV.jhgeaWS.khhf
cZWSkhifdaYW.56cacZW.3aXZW.4YTWU.4cbcZW.3bZaXT.3ZXYVS.3dcdaWP.2cbcYUP.2bZaXTS.2dddaW.3cccZVP.2babYUQ.2
dedaWT.2dddaWS.2cbcYVR.2deeaW.3deebXS.2dcdaWS.2dgfcZ.3effcYU.2eeebXT.2foli.4fiifbWS.gggdaXUS.320A.7A.7
A.7Y.7aedZXV.2YabZXWV.81bQ.318bfhgbU.2YZ.6V.495cXVI.4baZU.4a.7bW.6dZY.5eaZT.4fbaU.4fcbVJ.11dYSI.60Yef
eeb.2dc.6gefdba.2hffdbYU.jggebYU.jhhecYU.khifdaVM.8Ydgfeb.2dcf.5gefdbb.2iggdbZU.jggebZU.jhhecYU.kiigd
aVM.280Q.7O.7J.7VS.14S.7O.7O.7W.15SZ.6P.7N.7XT.14SYf.5PU.6NS.6YUX.13TbfT.4RV.6PU.6ZUW.13UfiUO.3SafS.4
RYeU.4aWXS.4TUYV.4TUYV.4VVYV.4XWZWS.3ZYbXU.3cbdaYVU.ZT.6YT.6ZU.6ZV.6aXZY.4cbcaZX.2bV.6aV.6aV.6bW.6bYZ
.5dbcbZX.2aX.6aV.6bW.6bXZ.5cYZY.4ebcbZX.2bYa.5bX.6cY.6cZZ.5dZZZ.4fccbZXW.eab.5dZa.5eaZ.5eaaZ.4ebbY.4h
edbaYV.gedb.4gdda.4fdc.5gdcZ.4gddZX.3iffcaYWWihhecZ.2jggdc.3iggdc.3ighdbZ.2jhgdbZY.liifdbYWaXZYV.3cXZ
XU.3dZaXV.3ebbXUT.2fddZVS.2gefcZWV.ccdbZ.3ca.6da.6ecdZ.4fddb.4gefcZ.3dcdba.3ea.6d.7gdb.5gedb.4hefcZ.3
ecebZ.3ea.6eb.6gcea.4hdda.4iffcZX.2gdecZX.2fb.6gc.6hddc.4ieebY.3jffdaX.2heecaXW.g.7g.7ifeb.4igebZ.3jh
gdbYV.jggdaYV.25khgdZ.3liifcZW.ljjgebZW.24kkjg.4nkjhebZXZTZX.4YTW.5ZWX.5aZZV.4bdcY.4af.6ZXaYW.3ZWYWV.3
aYZWU.3baaXU.3bccZV.3cgfcYV.2aXZXV.3ZWYVT.3aYYWU.3baaWT.3cccYU.3cffbXV.2bZaYW.3aYZW.4bZZW.4caaWT.3ccc
YU.3dffbYV.2cbcZW.3bZaXU.3caaXV.3cbbXV.3dccYVS.2dffbXV.2dcdaXS.2cbbYW.3cbbYV.3dccZW.3dddaWT.2effcYW.2
eeebXS.2dcdaX.3dddaX.3eddaX.3eeebXU.2fggcZWV.fffcYU.2fefcZX.2fffcZ.3fffcZW.2fffcaWS.gghdaYVSIU.6bVX.5
fZV.5gdb.21OXaX.4cXYW.4eaYX.4gcbX.4heeaV.3jigea.3MXaY.4cXYV.4eZZV.4gcbV.4iedZ.4kg.6MZa.5cYZ.5faY.5gda
V.4iffa.12NbbY.4dZZ.5fbZ.5gdbX.4hfea.4khif.4OddZ.4eba.5fbZ.5gecX.4iffa.4kiiea.3QffbY.3fc.6hc.6iecY.4j
hfb.4lhjgc.3UgfbZYV.17hfda.4kgfa.4kijfcZ.2bP.382kmmhcT.2U.15b.7dfmb.4adhgcV.338dZYUI.3dYSI.372jhhfdaV
L.40gghecZU.iggebZT.iggebYT.jhhebYT.khhfcYT.kiigdaVK.288U.47V.47TW.6V.39T.47VV.6X.39WVcS.4YT.38WWaS.4
ZT.6aV.6V.23XYaTN.3aWW.5bXX.5XZb.5W.18YYXXXW.18YYXXXWV.17YXWVV.19YXWW.44caW.21WT.22ZZZXT.19VS.27TS.32
eZ.7gcY.6hebZ.5jfdba.4jhecba.3kigecbb.2ljhfdccc.2KIJJL.11SRRSR.27acXaaYYaZZZWXW.2adWZaY.3aYY.4adX.aY.10
b.Y.60ZZZZZZZZZaaZZZZZZZZZZZZZZZYYYYZZZZaaaaaYXWWXYaabbbbZ.26ZZYYXXZZYW.2ZZYWS.ZYYXQ.YZZXS.ZZZYX.ZZZZ
Z.ZZZZ.2aZaa.2aaab.2aaaa.2aaaa.2ZZZZY.YZZZZZYYZY.2XYYZ.2YYYX.2YZZXT.YZZZ.2ZZZZZaZZZZ.2aaZa.2aaaa.2aaa
a.2aaaZ.2ZZZZZZYYZZZaYYYXV.YYYYWSYZZYX.ZZZZ.2ZZaab.aaaaa.aaaa.2aaZZZZ.25Xfag.5o.2Wadd.5o.4gcfccabaYYX
YV.3ifjhjhihhhhhdSzzELNNMNONOPOPQQSSSTTTUVVWXSTURRSSTVUVVWYZ.216UUUWUTRRUSWXVTR.VWUYWUR.WYZUXVR.UVVWT
TR.STUUSQQ.RQQQRQMM.7Q.193aXVUUTP.aWWVVUS.aWVXVTT.Z.5V.2YXWVVS.2ZYYYXU.baZaY.X.a.5a.2a.ZYXQ.2a.aa.W.2
bZdaeZ.d.5c.7L.7W.7b.h.2l.2e.131HLID.3QWTPJ.2QTWSQL.QRSVRQL.QTTWTRK.QTUWRQL.RRUVQQL.QUSWTQL.RRUWRQL.R
RTVRPM.QTTXSRM.RTUXTRN.SSUXSPN.RUVXSQO.STWXURP.VWWXUSRS.128SRRRRRSRSRSRRRRRRRRRRRQSTSSTSTTUTTUW.92VVV
VVVVVVVVVVVVVVVVVVW.106WXXXXWV.XYXXYWU.XXZYYXV.XXZbZYW.XXYYXWV.WXWWWWU.VUVVUUTQ.7T.193taYXWWU.qZYXVVT
.2ZYYXWT.2bYXW.T.3XXXXV.4YYYW.4a.2W.saZbbZW.7Y.7Z.7Z.3da.dZ.31e.128XYYaXWT.WXYYXVT.WXYXWVT.WXWXWUT.WW
WWVUT.WWXWVUS.WWVWTTS.VWVVUTS.WWVVU.S.VVV.3S.V.5S.V.5R.V.5R.U.5R.V.5R.WUVTWVT.130bdbZb.dghfe.egikg.fg
ill.ffikm.fgikn.fghio.ffhin.dfghn.defgm.bdfim.adgioktsqobceefeggggfiiiigkllkk.2rr.42hmprrrssrppmZcdff
gggfffhbfhiklkkkjjkcgjlnopoolkpdhloqqqsqomsekosuuutuspv.61jgggggghhhg.bdaab.eghef.fgjlh.fhjll.fgjln.g
gikn.gfhko.gfhjp.fegho.fdeho.dfhgo.bcefmgyxxwcdegifhhiigjkkkjoooonmpqt.42eilmnmnnlmmhZcefghhhhgfjcfhk
lnopomlpdikoqrtuttrufknrsuvuuutxgmqutvvvvuuz.Vbbccddddee.ceeefffgfff.giijjjijjji.jkllllmlmkk.osssssst
tup.302l.69u.71s.83s.59pbjarbndkZgemcjgmfjiifihgfgfgggghWdhkbdigbdffcfggfihhfihffgffggfldeeickjfcieig
mfghkcgghfggggggggkfiZggflffdhfgfhfggfggggggggggggggggggggggggggggggggggggggggggggggggggggggggggggggg
gggggggggggggchccclccfifddgfeggggggggggggggggbedddddeddceddceddceeededdddggggaatWcdlcfflfgggggggggggg
ggggggggbbabbaacggchgcoKUZelgggggggggabcbclX.eln.Xll.9i.18
)";
}  // namespace rill::format
