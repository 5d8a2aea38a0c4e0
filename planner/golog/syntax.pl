:- module(planner_syntax,
          [ well_formed/1,              % +Program
            well_formed/2               % +Revision, +Head
          ]).

/** <module> The grammar of programs

A program is written in these terms, which kb/compiler.py makes of OWL-S 1.2 processes and whose meaning
planner_transition gives. Frame stands for the invocation of the process that the construct is in, Step
is the name of the construct: together they are the id of a step, choice or pick. [ConGolog], [IndiGolog]
and [Golog] are cited there.

    [P, ...]                                 Sequence      one after the other; [] is nothing to do: [ConGolog] 3
    conc([P, ...])                           Split-Join    side by side: [ConGolog] 4
    choice(Frame, Step, [P, ...])            Choice        one of them: [Golog]
    pick(Frame, Step, V, Class, P)           local of P    P with an individual of Class for V (pi): [Golog]
    foreach(Frame, Step, [V-Class, ...], C, Inner, P)
                                             For-Each      P, with Inner for its frame, side by side for all
                                                           individuals of which C holds
    if(C, P, Q)                              If-Then-Else  P where C holds, else Q: [ConGolog] 3
    while(C, P)                              Repeat-While  P as long as C holds: [ConGolog] 3
    until(P, C)                              Repeat-Until  P, again until C holds
    call(Frame, Step, Head)                  Perform       a process, atomic or composite: [ConGolog] 4
    test(C)                                  (condition)   goes on when C holds: [IndiGolog]

A condition C is one of

    all([C, ...])  any([C, ...])  not(C)     AllOf, AnyOf, Not; not is by failure: closed world
    holds(Property, Subject, Value)          a property has a value, as far as is known
    is_true(loc(Frame, Name))                the truth value that an action has found out

Arguments of a Head are individuals, literals, loc(Frame, Name) for data, and fluent(Property, Subject)
for the value that a property has when the process begins.

The body of a loop must have something to do every time: a loop that turns without a step would turn
without time passing, for ever.

As a program is executed, three terms take the place of what has begun: running(Id) of a step,
scope(Id, Head, P) of a composite process, picked(Id-Individual, Pick, P) of a pick, with the pick as it
was. They are not written.
*/

:- use_module(library(lists)).
:- use_module(library(apply)).
:- use_module(kb_rules(facts), [definition/4, duration/3]).

:- multifile prolog:error_message//1.

prolog:error_message(malformed_program(Term, Wanted)) -->
    [ 'malformed program: ~p is not ~w'-[Term, Wanted] ].

%!  well_formed(+Revision, +Head) is det.
%
%   The process exists, and its body and all that it calls are well-formed.
%
%   @error malformed_program(Subterm, Wanted)

well_formed(Revision, Head) :-
    (   definition(Revision, Head, _, Body)
    ->  well_formed(Body),
        forall(called(Body, Callee), well_formed(Revision, Callee))
    ;   duration(Revision, Head, _)
    ->  true
    ;   refuse(Head, 'the head of a process')
    ).

%!  well_formed(+Program) is det.
%
%   @error malformed_program(Subterm, Wanted)

well_formed(P) :- var(P), !, refuse(P, 'a program').
well_formed([]) :- !.
well_formed([P|Ps]) :- !, well_formed(P), programs(Ps).
well_formed(conc(Ps)) :- !, programs(Ps).
well_formed(choice(Frame, Step, Ps)) :- !, named(Frame, Step), programs(Ps).
well_formed(pick(Frame, Step, V, Class, P)) :- !,
    named(Frame, Step),
    typed(V-Class),
    well_formed(P).
well_formed(foreach(Frame, Step, Vars, C, Inner, P)) :- !,
    named(Frame, Step),
    ( is_list(Vars), Vars \== [] -> maplist(typed, Vars) ; refuse(Vars, 'a list of Variable-Class') ),
    condition(C),
    ( var(Inner) -> true ; refuse(Inner, 'a variable for the frame of a turn') ),
    well_formed(P).
well_formed(if(C, P, Q)) :- !, condition(C), well_formed(P), well_formed(Q).
well_formed(while(C, P)) :- !, condition(C), well_formed(P), steps(while(C, P), P).
well_formed(until(P, C)) :- !, condition(C), well_formed(P), steps(until(P, C), P).
well_formed(call(Frame, Step, Head)) :- !,
    named(Frame, Step),
    ( callable(Head) -> true ; refuse(Head, 'the head of a process') ).
well_formed(test(C)) :- !, condition(C).
well_formed(P) :- refuse(P, 'a program').

programs(Ps) :-
    ( is_list(Ps) -> maplist(well_formed, Ps) ; refuse(Ps, 'a list of programs') ).

named(Frame, Step) :-
    ( var(Frame) -> true ; atom(Frame) -> true ; refuse(Frame, 'a frame') ),
    ( atom(Step) -> true ; refuse(Step, 'the name of a step') ).

typed(Typed) :-
    (   nonvar(Typed), Typed = V-Class, var(V), atom(Class)
    ->  true
    ;   refuse(Typed, 'a Variable-Class')
    ).

condition(C) :- var(C), !, refuse(C, 'a condition').
condition(all(Cs)) :- is_list(Cs), !, maplist(condition, Cs).
condition(any(Cs)) :- is_list(Cs), !, maplist(condition, Cs).
condition(not(C)) :- !, condition(C).
condition(holds(Property, _, _)) :- atom(Property), !.
condition(is_true(Location)) :- nonvar(Location), Location = loc(_, Name), atom(Name), !.
condition(C) :- refuse(C, 'a condition').

steps(Loop, P) :-
    ( stepless(P) -> refuse(Loop, 'a loop with something to do every time') ; true ).

%   P may end without a step.
stepless(Ps) :- is_list(Ps), forall(member(P, Ps), stepless(P)).
stepless(conc(Ps)) :- stepless(Ps).
stepless(choice(_, _, Ps)) :- member(P, Ps), stepless(P), !.
stepless(pick(_, _, _, _, P)) :- stepless(P).
stepless(foreach(_, _, _, _, _, _)).
stepless(if(_, P, Q)) :- ( stepless(P) -> true ; stepless(Q) ).
stepless(while(_, _)).
stepless(test(_)).

called([P|Ps], Head) :- ( called(P, Head) ; called(Ps, Head) ).
called(conc(Ps), Head) :- called(Ps, Head).
called(choice(_, _, Ps), Head) :- called(Ps, Head).
called(pick(_, _, _, _, P), Head) :- called(P, Head).
called(foreach(_, _, _, _, _, P), Head) :- called(P, Head).
called(if(_, P, Q), Head) :- ( called(P, Head) ; called(Q, Head) ).
called(while(_, P), Head) :- called(P, Head).
called(until(P, _), Head) :- called(P, Head).
called(call(_, _, Head), Head).

refuse(Term, Wanted) :-
    throw(error(malformed_program(Term, Wanted), _)).
