MODULE Pick
  PERS tooldata tGripper:=[TRUE,[[31,0,100],[1,0,0,0]],[1.2,[0,0,50],[1,0,0,0],0,0,0]];
  TASK PERS wobjdata wTray:=[FALSE,TRUE,"",[[250,-100,50],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];
  CONST jointtarget jHome:=[[0,-10,20,0,60,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pAbove:=[[60,40,150],[0,0,1,0],[-1,0,-1,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pPick:=[[60,40,30],[0,0,1,0],[-1,0,-1,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget pPlace:=[[160,140,30],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    MoveAbsJ jHome,v1000,fine,tGripper;
    MoveJ pAbove,v500,z10,tGripper\WObj:=wTray;
    MoveL pPick,v100,fine,tGripper\WObj:=wTray;
    MoveL Offs(pPick,0,0,100),v100,z10,tGripper\WObj:=wTray;
    MoveJ pPlace,v500,fine,tGripper\WObj:=wTray;
  ENDPROC
ENDMODULE
