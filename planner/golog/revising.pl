:- module(planner_revising,
          [ revised/4,                  % +Program, +Situation, -Program, -Situation
            unfit/3,                    % +Program, +Situation, -Ids
            released/4,                 % +Program, -Program, +Situation, -Situation
            runs/2,                     % +Program, ?Id
            drop_all/3                  % +Program, +Situation, -Situation
          ]).

/** <module> What is left to do, after the world or what is known of it has changed

The turns of a for-each are those of when it was come to. When something that no action of ours did
changes for which individuals its condition holds, or with which others, the turns are seen to again:
one that fits no more is given up, one whose individuals are others now begins anew with them, one for a
new individual is added. What is done stays done ([RoboEarth] 3.3.2).
*/

:- use_module(library(lists)).
:- use_module(library(apply)).
:- use_module(library(occurs), [sub_term/2]).
:- use_module(kb_rules(capability), [capable/3]).
:- use_module(planner_golog(actions)).
:- use_module(planner_golog(projection)).
:- use_module(planner_golog(transition)).

%!  revised(+Program, +Situation, -Program, -Situation) is det.
%
%   What runs in a turn that is given up is noted as abandoned(Id, Head, Agents).

revised(scope(Id, Head, P), S0, scope(Id, Head, Q), S) :- !,
    expansion(Id, Head, S0, Body),
    findall(F, ( sub_term(F, Body), nonvar(F), F = foreach(_, _, _, _, _, _) ), Loops),
    foldl(revise_turns, Loops, P-S0, P1-S1),
    revised(P1, S1, Q, S).
revised([P|Ps], S0, [Q|Ps], S) :- !, revised(P, S0, Q, S).
revised(conc(Ps), S0, conc(Qs), S) :- !, foldl(revised_part, Ps, Qs, S0, S).
revised(pconc(Ps), S0, pconc(Qs), S) :- !, foldl(revised_part, Ps, Qs, S0, S).
revised(picked(Id, Pick, P), S0, picked(Id, Pick, Q), S) :- !, revised(P, S0, Q, S).
revised(deadline(Ms, P), S0, deadline(Ms, Q), S) :- !, revised(P, S0, Q, S).
revised(P, S, P, S).

revised_part(P, Q, S0, S) :- revised(P, S0, Q, S).

%   The turns of one for-each, if it has been come to.
revise_turns(foreach(Frame, Step, Vars, Condition, Inner, Body), P0-S0, P-S) :-
    (   ground(Frame),
        step_id(Frame, Step, Id),
        known(turns(Id), Before, S0)
    ->  turns(Frame, Step, Vars, Condition, Inner-Body, S0, Now),
        named(Now, Names),
        set_data(turns(Id), Names, S0, S1),
        findall(Name, ( member(Name-Tuple, Before), \+ memberchk(Name-Tuple, Names) ), Gone),
        findall(Turn, ( member(turn(Name, Tuple, Turn), Now), \+ memberchk(Name-Tuple, Before) ), New),
        in_turns(P0, Id, Gone, New, S1, P, S)
    ;   P = P0, S = S0
    ).

named(Turns, Names) :-
    findall(Name-Tuple, member(turn(Name, Tuple, _), Turns), Names).

%   The concurrency that stands where the for-each stood.
in_turns(P, _, [], [], S, P, S) :- !.
in_turns([P|Ps], Id, Gone, New, S0, [Q|Ps], S) :- !, in_turns(P, Id, Gone, New, S0, Q, S).
in_turns(conc(Ps), Id, Gone, New, S0, conc(Qs), S) :-
    once(( member(P, Ps), turn_of(P, Id, _) )), !,
    foldl(given_up(Id, Gone), Ps, Left, S0, S),
    append(Left, Kept),
    append(Kept, New, Qs).
in_turns(conc(Ps), Id, Gone, New, S0, conc(Qs), S) :-
    select(P, Ps, Q, Qs), P = conc(_), in_turns(P, Id, Gone, New, S0, Q, S), !.
in_turns(P, _, _, New, S, conc([P|New]), S).

given_up(Id, Gone, P, Left, S0, S) :-
    (   turn_of(P, Id, Name), memberchk(Name, Gone)
    ->  Left = [],
        drop_all(P, S0, S)
    ;   Left = [P], S = S0
    ).

%!  unfit(+Program, +Situation, -Ids) is det.
%
%   The actions that run for the choice of a robot which is not capable of what it is to do next.

unfit(P, S, Ids) :-
    running(S, Runs),
    findall(Id, ( sub_term(T, P), nonvar(T), T = picked(_-Robot, _, Chosen), must_not(Robot, Chosen, S),
                  member(run(_, _, Id, _), Runs), runs(Chosen, Id) ), Found),
    sort(Found, Ids).

%!  released(+Program, -Program, +Situation, -Situation) is det.
%
%   Such a choice is open again, where nothing runs for it.

released([P|Ps], [Q|Ps], S0, S) :- !, released(P, Q, S0, S).
released(conc(Ps), conc(Qs), S0, S) :- !, foldl(released, Ps, Qs, S0, S).
released(pconc(Ps), pconc(Qs), S0, S) :- !, foldl(released, Ps, Qs, S0, S).
released(scope(I, H, P), scope(I, H, Q), S0, S) :- !, released(P, Q, S0, S).
released(deadline(Ms, P), deadline(Ms, Q), S0, S) :- !, released(P, Q, S0, S).
released(picked(Pick-X, Again, P), Q, S0, S) :- !,
    (   must_not(X, P, S0), running(S0, Runs), \+ ( member(run(_, _, Id, _), Runs), runs(P, Id) )
    ->  Q = Again, drop_all(P, S0, S)
    ;   Q = picked(Pick-X, Again, R), released(P, R, S0, S)
    ).
released(P, P, S, S).

%   Robot is to do something in Chosen that it is not capable of; of a choice, in every branch.
must_not(Robot, Chosen, S) :- nonvar(Chosen), barred(Chosen, Robot, S), !.

barred(picked(_, _, P), Robot, S) :- !, must_not(Robot, P, S).
barred(choice(_, _, Ps), Robot, S) :- !, forall(member(P, Ps), must_not(Robot, P, S)).
barred(call(_, _, Head), Robot, S) :- !,
    nonvar(Head),
    agents_of(Head, Agents, S),
    member(Agent, Agents), Agent == Robot,
    functor(Head, Name, _),
    revision(S, Revision),
    \+ capable(Revision, Name, Robot).
barred(P, Robot, S) :-
    compound(P),
    arg(_, P, Part),
    must_not(Robot, Part, S).

%!  runs(+Program, ?Id) is nondet.
%
%   An action runs there.

runs([P|_], Id) :- runs(P, Id).
runs(conc(Ps), Id) :- member(P, Ps), runs(P, Id), !.
runs(pconc(Ps), Id) :- member(P, Ps), runs(P, Id), !.
runs(scope(_, _, P), Id) :- runs(P, Id).
runs(picked(_, _, P), Id) :- runs(P, Id).
runs(deadline(_, P), Id) :- runs(P, Id).
runs(running(Id), Id).

%!  drop_all(+Program, +Situation, -Situation) is det.
%
%   Program is given up: what runs in it is noted as abandoned, what its processes have is free.

drop_all(P, S0, S) :-
    running(S0, Runs),
    findall(R, ( sub_term(T, P), nonvar(T), T = running(R), memberchk(run(_, _, R, _), Runs) ), Running),
    foldl(abandon, Running, S0, S1),
    findall(I-H, ( sub_term(T, P), nonvar(T), T = scope(I, H, _) ), Scopes),
    give_up(Scopes, S1, S).

abandon(Id, S0, S) :-
    running(S0, Runs),
    memberchk(run(_, Agents, Id, Head), Runs),
    stop(Id, S0, S1),
    note(abandoned(Id, Head, Agents), S1, S).

%   The program P is (what is left of) the turn Name of the for-each Id: all its steps are called so.
turn_of(P, Id, Name) :-
    atom_concat(Id, /, Prefix),
    sub_term(T, P),
    nonvar(T),
    (   T = call(Whole, _, _) ; T = pick(Whole, _, _, _, _) ; T = choice(Whole, _, _)
    ;   T = scope(Whole, _, _) ; T = running(Whole) ; T = picked(Whole-_, _, _)
    ),
    atom(Whole),
    atom_concat(Prefix, Rest, Whole), !,
    ( sub_atom(Rest, Before, _, _, /) -> sub_atom(Rest, 0, Before, _, Name) ; Name = Rest ).
